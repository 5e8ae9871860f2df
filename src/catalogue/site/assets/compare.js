'use strict';
// Several materials on one plot. The address holds which, so that it can be kept or sent.
(() => {
  const MOST = 6, OFFERED = 12;
  const SVG = 'http://www.w3.org/2000/svg';
  // Names of the curves stand right of the data.
  const WIDTH = 720, HEIGHT = 420, LEFT = 84, RIGHT = 170, TOP = 44, BOTTOM = 64, GAP = 8;
  const SLUG = /^[a-z0-9][a-z0-9-]{0,63}$/;

  const byId = (id) => document.getElementById(id);
  const chooser = byId('chooser'), add = byId('add'), matches = byId('matches'), said = byId('found');
  const portions = Number(chooser.dataset.portions);
  const index = [];
  const known = new Map();
  let chosen = [];

  const plain = (text) => text.normalize('NFKD').replace(/\p{M}/gu, '').toLowerCase();
  const fill = (element, attributes, inside) => {
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...inside);
    return element;
  };
  const make = (name, attributes, ...inside) => fill(document.createElement(name), attributes, inside);
  const draw = (name, attributes, ...inside) => fill(document.createElementNS(SVG, name), attributes, inside);
  const badge = (kind, words = kind) => make('span', { class: `badge is-${kind}${words === kind ? '' : ' is-fitted'}` }, words);
  const badges = ({ kind, kind_words: words, status }) => [badge(kind, words ?? kind), ' ', ...(status ? [badge(status), ' '] : [])];

  // Loading: a page opened from a folder may load scripts and nothing else.
  const load = (path) => new Promise((resolve, reject) => {
    const script = make('script', { src: path });
    script.onload = () => { script.remove(); resolve(); };
    script.onerror = () => { script.remove(); reject(new Error(path)); };
    document.head.append(script);
  });
  window.matdbMaterial = (material) => known.set(material.slug, material);
  window.matdbIndex = ({ entries }) => {
    for (const { slug, name, class: stuff, kind } of entries) index.push({ slug, name, kind, words: plain(`${slug} ${name} ${stuff}`) });
  };
  let reading = null;
  const readIndex = () => {
    reading ??= (async () => {
      for (let part = 1; part <= portions; part += 1) {
        try { await load(`index/${part}.js`); } catch { said.textContent = `Part ${part} of the index could not be read; reload the page.`; }
        offer();
      }
    })();
    return reading;
  };

  // Choosing.
  const offer = () => {
    const words = plain(add.value).split(/\s+/).filter(Boolean);
    const fits = index.filter((entry) => !chosen.includes(entry.slug) && words.every((word) => entry.words.includes(word)));
    const isFull = chosen.length >= MOST;
    matches.replaceChildren(...(isFull ? [] : fits.slice(0, OFFERED)).map((entry) => {
      const button = make('button', { type: 'button', class: 'quiet-button', 'data-slug': entry.slug }, '+ ', make('bdi', {}, entry.name));
      return make('li', {}, button);
    }));
    if (!index.length) return;
    if (isFull) said.textContent = `${MOST} are on the plot; remove one to add another.`;
    else if (!fits.length) said.textContent = 'No other material matches.';
    else said.textContent = fits.length > OFFERED ? `${OFFERED} of ${fits.length} materials; type to narrow them.` : `${fits.length} to choose from.`;
  };
  const toAddress = () => {
    history.replaceState(null, '', chosen.length ? `#m=${chosen.join(',')}` : location.pathname + location.search);
  };
  const fromAddress = () => {
    const wanted = new URLSearchParams(location.hash.slice(1)).get('m') ?? '';
    chosen = [...new Set(wanted.split(',').filter((slug) => SLUG.test(slug)))].slice(0, MOST);
    refresh();
  };
  matches.addEventListener('click', ({ target }) => {
    const slug = target.closest('button')?.dataset.slug;
    if (!slug || chosen.length >= MOST) return;
    chosen.push(slug);
    toAddress();
    refresh();
    add.focus();
  });
  const remove = (slug) => {
    chosen = chosen.filter((other) => other !== slug);
    toAddress();
    refresh();
    (byId('chosen').querySelector('button') ?? add).focus();
  };
  const refresh = async () => {
    offer();
    const asked = chosen.join();
    const missing = chosen.filter((slug) => !known.has(slug));
    const wrong = [];
    await Promise.all(missing.map((slug) => load(`data/${slug}.js`).catch(() => wrong.push(slug))));
    if (asked !== chosen.join()) return;
    list(wrong);
    const there = chosen.map((slug, ink) => ({ ink, material: known.get(slug) })).filter(({ material }) => material);
    byId('figure').hidden = byId('values').hidden = !there.length;
    byId('plot').replaceChildren();
    if (!there.length) return;
    const picture = plot(there);
    if (picture) {
      byId('plot').append(picture);
      name(picture, there);
      window.matdbPlot(picture);
    }
    byId('values').replaceChildren(table(there));
  };

  // What is shown.
  const styled = (ink, { render }, line) => `line ink${ink} is-${line.kind}${line.name === render ? '' : ' faint'}`;
  const sample = (ink, material, line) => {
    const svg = draw('svg', { class: 'sample', viewBox: '0 0 34 14', 'aria-hidden': 'true' });
    svg.append(draw('path', { class: styled(ink, material, line), d: 'M1 7h32' }));
    return svg;
  };
  // What else is drawn of a material, beside what scenes render.
  const others = (ink, material) => material.lines.filter((line) => line.name !== material.render).map((line) => make('span', { class: 'quiet' },
    sample(ink, material, line), ' not rendered: ', make('bdi', {}, line.name), ' ', line.kind_words ?? line.kind));
  const list = (wrong) => {
    byId('chosen').replaceChildren(...chosen.map((slug, ink) => {
      const material = known.get(slug);
      const name = material?.name ?? slug;
      const button = make('button', { type: 'button', class: 'quiet-button', 'aria-label': `Remove ${name}` }, 'Remove');
      button.addEventListener('click', () => remove(slug));
      if (!material) return make('li', {}, wrong.includes(slug) ? `There is no material ${slug}.` : slug, button);
      const link = make('a', { href: `material/${slug}.html` }, make('bdi', {}, name));
      const rendered = material.lines.filter((line) => line.name === material.render);
      return make('li', {}, ...rendered.map((line) => sample(ink, material, line)), link, ...badges(material), ...others(ink, material), button);
    }));
  };
  // Ticks at round values, at least four of them.
  const ticks = (low, high, wanted) => {
    for (let more = wanted; ; more += 1) {
      const rough = (high - low) / more, power = 10 ** Math.floor(Math.log10(rough));
      const every = power * ([1, 2, 5].find((factor) => factor * power >= rough * (1 - 1e-9)) ?? 10);
      const first = Math.ceil(low / every - 1e-9), last = Math.floor(high / every + 1e-9);
      const decimals = Math.max(0, -Math.floor(Math.log10(every) + 1e-9));
      if (last - first >= 3 || more > 12) return Array.from({ length: last - first + 1 }, (_, i) => [(first + i) * every, ((first + i) * every).toFixed(decimals).replace('-', '−')]);
    }
  };
  const plot = (there) => {
    const drawn = there.flatMap(({ material: m }) => [...m.lines.flatMap((line) => line.pieces.flat()), ...m.curves.flatMap((c) => [...c.seen, ...c.below, ...c.above])]);
    if (!drawn.length) return null;
    let low = Infinity, high = -Infinity, last = 0;
    for (const [deg, level] of drawn) { low = Math.min(low, level); high = Math.max(high, level); last = Math.max(last, deg); }
    last = Math.min(90, last + 2);
    const room = Math.max(1, 0.06 * (high - low));
    low -= room; high += room;
    const x = (deg) => (LEFT + deg / last * (WIDTH - LEFT - RIGHT)).toFixed(1);
    const y = (level) => (HEIGHT - BOTTOM - (level - low) / (high - low) * (HEIGHT - TOP - BOTTOM)).toFixed(1);
    const names = there.map(({ material }) => material.name).join(', ');
    const ends = { 'data-x': `0 ${last} ${LEFT} ${WIDTH - RIGHT}`, 'data-y': `${low} ${high} ${HEIGHT - BOTTOM} ${TOP}` };
    const svg = draw('svg', { class: 'plot', viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: 'img', 'aria-labelledby': 'plot-title plot-text', ...ends },
      draw('title', { id: 'plot-title' }, `Backscatter of ${names}`),
      draw('desc', { id: 'plot-text' }, 'σ⁰ in dB over the angle of incidence. The table below holds the levels.'));
    for (const [level, words] of ticks(low, high, 7)) {
      svg.append(draw('path', { class: level ? 'grid' : 'grid zero', d: `M${LEFT} ${y(level)}H${WIDTH - RIGHT}` }),
        draw('text', { class: 'tick', x: LEFT - 9, y: Number(y(level)) + 6, 'text-anchor': 'end' }, words));
    }
    for (const [deg, words] of ticks(0, last, 9)) {
      svg.append(draw('path', { class: 'grid', d: `M${x(deg)} ${TOP}V${HEIGHT - BOTTOM}` }),
        draw('text', { class: 'tick', x: x(deg), y: HEIGHT - BOTTOM + 26, 'text-anchor': 'middle' }, words));
    }
    svg.append(draw('text', { class: 'label', x: (LEFT + WIDTH - RIGHT) / 2, y: HEIGHT - 10, 'text-anchor': 'middle' }, 'angle of incidence, °'),
      draw('text', { class: 'label', x: 9, y: 26 }, 'σ⁰, dB'));
    const each = (points, mark) => points.map(([deg, level]) => `M${x(deg)} ${y(level)}${mark}`).join('');
    const put = (style, points, path, title) => { if (points.length) svg.append(draw('path', { class: `${style}${points.length > 150 ? ' many' : ''}`, 'data-name': title, d: path })); };
    for (const { ink, material } of there) {
      for (const { name: curve, kind, seen, below, above } of material.curves) {
        const title = `${material.name}, ${curve}`;
        const own = `ink${ink} is-${kind}`;
        put(`dots ${own}`, seen, each(seen, 'h0'), title);
        put(`mark ${own}`, below, each(below, 'm-4-3h8l-4 7z'), title);
        put(`mark ${own}`, above, each(above, 'm-4 3h8l-4-7z'), title);
      }
    }
    for (const { ink, material } of there) {
      for (const line of material.lines) {
        for (const piece of line.pieces) {
          const path = piece.map(([deg, level], i) => `${i ? 'L' : 'M'}${x(deg)} ${y(level)}`).join('');
          const title = line.name === material.render ? material.name : `${material.name}, ${line.name}`;
          svg.append(draw('path', { class: styled(ink, material, line), 'data-name': title, d: path }));
        }
      }
    }
    return svg;
  };
  // The name of each material at the end of what scenes render, or else of another line or its points; names keep apart.
  const name = (svg, there) => {
    const ends = [];
    for (const { ink, material } of there) {
      const paths = [...svg.querySelectorAll(`path.ink${ink}`)], lines = paths.filter((path) => path.classList.contains('line'));
      const own = lines.filter((path) => !path.classList.contains('faint')).at(-1) ?? lines.at(-1) ?? paths.at(-1);
      const [, x, y] = [...(own?.getAttribute('d') ?? '').matchAll(/[ML]([-\d.]+) ([-\d.]+)/g)].at(-1)?.map(Number) ?? [];
      if (y !== undefined) ends.push({ ink, material, x, y, at: y });
    }
    ends.sort((a, b) => a.y - b.y);
    const left = WIDTH - RIGHT + 3 * GAP;
    for (const end of ends) {
      end.text = draw('text', { class: `name ink${end.ink}`, x: left }, end.material.name);
      svg.append(end.text);
      for (let cut = end.material.name.length; end.text.getComputedTextLength() > WIDTH - left && cut > 1;) {
        cut -= 1;
        end.text.textContent = `${end.material.name.slice(0, cut).trimEnd()}…`;
      }
      end.text.append(draw('title', {}, end.material.name));
    }
    const row = ends.length ? 1.25 * parseFloat(getComputedStyle(ends[0].text).fontSize) : 0;
    let least = TOP + row / 2;
    for (const end of ends) { end.at = Math.max(end.at, least); least = end.at + row; }
    let most = HEIGHT - BOTTOM;
    for (const end of ends.toReversed()) { end.at = Math.min(end.at, most); most = end.at - row; }
    for (const { ink, text, x, y, at } of ends) {
      text.setAttribute('y', (at + row / 4).toFixed(1));
      svg.append(draw('path', { class: `leader ink${ink}`, d: `M${x} ${y}L${WIDTH - RIGHT + GAP} ${at.toFixed(1)}H${left - 4}` }));
    }
  };
  const table = (there) => {
    const head = make('tr', {}, make('th', { scope: 'col' }, 'incidence'),
      ...there.map(({ material }) => make('th', { scope: 'col' }, make('bdi', {}, material.name), ' ', ...badges(material))));
    const rows = there[0].material.table.deg.map((deg, row) => make('tr', {}, make('th', { scope: 'row' }, `${deg}°`),
      ...there.map(({ material }) => make('td', {}, material.table.level[row]))));
    return make('table', { class: 'numbers compared' }, make('caption', {}, 'σ⁰, dB, of what scenes render'), make('thead', {}, head), make('tbody', {}, ...rows));
  };

  chooser.hidden = false;
  add.addEventListener('focus', readIndex, { once: true });
  add.addEventListener('input', () => { readIndex(); offer(); });
  window.addEventListener('hashchange', fromAddress);
  fromAddress();
  if (!chosen.length || portions <= 4) readIndex();
})();

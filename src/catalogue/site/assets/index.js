'use strict';
// Search, filters and order over the index, which comes in portions so that no number of materials
// blocks the page.
(() => {
  const SHOWN = 48;
  const MOST_COMPARED = 6;
  const SVG = 'http://www.w3.org/2000/svg';
  const LOW_DB = -60, HIGH_DB = 30;

  const byId = (id) => document.getElementById(id);
  const form = byId('search'), results = byId('results'), count = byId('count'), more = byId('more');
  const fields = ['q', 'kind', 'class', 'ghz', 'fitted', 'measured', 'sort'];
  const angles = form.dataset.angles.split(' ').map(Number);
  const portions = Number(form.dataset.portions);
  const collator = new Intl.Collator('en', { numeric: true, sensitivity: 'base' });

  const all = [];
  const classes = new Set();
  const compared = new Set();
  let loaded = 0, failed = 0, found = [], shown = 0;

  const plain = (text) => text.normalize('NFKD').replace(/\p{M}/gu, '').toLowerCase();
  const make = (name, attributes, ...inside) => {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...inside);
    return element;
  };
  const draw = (name, attributes) => {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return element;
  };
  const badge = (kind, words = kind) => make('span', { class: `badge is-${kind}${words === kind ? '' : ' is-fitted'}` }, words);
  const badges = ({ kind, kind_words: words, status }) => [badge(kind, words ?? kind), ' ', ...(status ? [badge(status), ' '] : [])];
  const number = (value) => value.toLocaleString('en').replaceAll(',', '\u202f');
  const range = ([low, high], unit) => (low === high ? `${low}` : `${low}–${high}`) + unit;

  window.matdbIndex = ({ entries }) => {
    for (const entry of entries) {
      entry.words = plain([entry.slug, entry.name, entry.class, entry.status ?? '', ...entry.tags, entry.text].join(' '));
      all.push(entry);
      classes.add(entry.class);
    }
  };

  // What is asked for, in the fields and in the address.
  const fromAddress = () => {
    const wanted = new URLSearchParams(location.hash.slice(1));
    for (const id of fields) {
      const value = wanted.get(id) ?? '';
      byId(id).value = value;
      if (byId(id).tagName === 'SELECT' && byId(id).value !== value) {
        if (id === 'class' && value) {
          byId(id).append(make('option', {}, value));
          byId(id).value = value;
        }
      }
      if (byId(id).selectedIndex === -1) byId(id).selectedIndex = 0;
    }
  };
  const toAddress = () => {
    const wanted = new URLSearchParams();
    for (const id of fields) {
      const value = byId(id).value.trim();
      if (value && !(id === 'sort' && value === 'name')) wanted.set(id, value);
    }
    history.replaceState(null, '', wanted.size ? `#${wanted}` : location.pathname + location.search);
  };

  const at = (entry, angle) => entry.level[angles.indexOf(angle)] ?? -Infinity;
  const orders = {
    name: (a, b) => collator.compare(a.name, b.name),
    class: (a, b) => collator.compare(a.class, b.class),
    ghz: (a, b) => a.ghz[0] - b.ghz[0],
    d0: (a, b) => at(b, 0) - at(a, 0) || 0,
    d30: (a, b) => at(b, 30) - at(a, 30) || 0,
    d60: (a, b) => at(b, 60) - at(a, 60) || 0,
  };
  const search = () => {
    const words = plain(byId('q').value).split(/\s+/).filter(Boolean);
    const [kind, kindOfStuff] = [byId('kind').value, byId('class').value];
    const [fitted, measured] = [byId('fitted').value, byId('measured').value];
    const typed = byId('ghz').value.trim().replace(',', '.');
    const ghz = typed === '' ? null : Number(typed);
    const wrong = ghz !== null && !(ghz > 0);
    byId('ghz-wrong').textContent = wrong ? `“${typed}” is no frequency; write a number in GHz, such as 300.` : '';
    byId('ghz').setAttribute('aria-invalid', String(wrong));
    const yes = (asked, is) => asked === '' || (asked === 'yes') === is;
    found = all.filter((e) => (!kind || e.kind === kind) && (!kindOfStuff || e.class === kindOfStuff)
      && (ghz === null || wrong || (e.ghz[0] <= ghz && ghz <= e.ghz[1]))
      && yes(fitted, e.fitted) && yes(measured, e.measured) && words.every((word) => e.words.includes(word)));
    const order = orders[byId('sort').value] ?? orders.name;
    found.sort((a, b) => order(a, b) || collator.compare(a.slug, b.slug));
    results.replaceChildren();
    shown = 0;
    show();
    say();
  };
  const say = () => {
    let text = found.length === all.length
      ? `${number(all.length)} ${all.length === 1 ? 'material' : 'materials'}`
      : `${number(found.length)} of ${number(all.length)} materials`;
    if (found.length === 0 && all.length) text += '. Nothing matches; take a filter away.';
    if (loaded + failed < portions) text += `, still reading part ${loaded + failed + 1} of ${portions} …`;
    if (failed) text += ` ${failed} of ${portions} parts of the index could not be read; reload the page.`;
    count.textContent = text;
  };

  // Cards, a screenful at a time.
  const curve = (entry) => {
    const svg = draw('svg', { class: 'small', viewBox: '0 0 270 90', preserveAspectRatio: 'none', 'aria-hidden': 'true' });
    for (const level of [-40, -20, 0, 20]) svg.append(draw('path', { class: level ? 'grid' : 'grid zero', d: `M0 ${y(level)}H270` }));
    let path = '';
    entry.level.forEach((level, i) => {
      if (level === null) return;
      const follows = i > 0 && entry.level[i - 1] !== null;
      path += `${follows ? 'L' : 'M'}${angles[i] * 3} ${y(level)}`;
    });
    svg.append(draw('path', { class: `line ink0 is-${entry.kind}`, d: path || 'M0 0' }));
    return svg;
  };
  const y = (level) => (90 * (HIGH_DB - Math.min(HIGH_DB, Math.max(LOW_DB, level))) / (HIGH_DB - LOW_DB)).toFixed(1);
  const holds = (entry) => {
    if (!entry.points) return 'No curve; the parameters are stated.';
    const share = entry.censored ? `${(100 * entry.censored / entry.points).toFixed(1)} % of them only bounds` : 'all detected';
    return `${number(entry.points)} points, ${share}. ${entry.fitted ? 'Fitted.' : 'Not fitted.'}`;
  };
  const card = (entry) => {
    const link = make('a', { href: `material/${entry.slug}.html` }, make('bdi', {}, entry.name));
    const choose = make('input', { type: 'checkbox', value: entry.slug, 'aria-label': `Compare ${entry.name}` });
    choose.checked = compared.has(entry.slug);
    return make('li', { class: 'card' }, curve(entry), make('h2', {}, link),
      make('p', {}, ...badges(entry), make('bdi', {}, entry.class)),
      make('p', { class: 'quiet' }, `${range(entry.ghz, '\u00a0GHz')}, ${range(entry.deg, '°')}. ${holds(entry)}`),
      make('label', {}, choose, 'Compare'));
  };
  const show = () => {
    const next = found.slice(shown, shown + SHOWN);
    results.append(...next.map(card));
    shown += next.length;
    more.hidden = shown >= found.length;
  };
  const sayCompared = () => {
    const link = byId('compare');
    link.href = compared.size ? `compare.html#m=${[...compared].join(',')}` : 'compare.html';
    link.textContent = compared.size ? `Compare ${compared.size} chosen` : 'Compare';
    for (const box of results.querySelectorAll('input')) box.disabled = compared.size >= MOST_COMPARED && !box.checked;
  };

  const fillClasses = () => {
    const select = byId('class'), value = select.value;
    const names = [...classes].sort(collator.compare);
    select.replaceChildren(select.options[0], ...names.map((name) => make('option', {}, name)));
    select.value = value;
    if (select.selectedIndex < 0) select.selectedIndex = 0;
  };

  let timer = 0;
  const soon = () => { clearTimeout(timer); timer = setTimeout(() => { toAddress(); search(); }, 90); };
  form.addEventListener('input', soon);
  form.addEventListener('reset', () => setTimeout(soon));
  form.addEventListener('submit', (event) => { event.preventDefault(); soon(); });
  window.addEventListener('hashchange', () => { fromAddress(); search(); });
  results.addEventListener('change', ({ target }) => {
    if (target.checked) compared.add(target.value); else compared.delete(target.value);
    sayCompared();
  });
  more.addEventListener('click', () => {
    const first = shown;
    show();
    sayCompared();
    results.children[first]?.querySelector('a').focus();
  });

  let asked = 0, seen = 0;
  const load = () => {
    if (asked >= portions) return;
    asked += 1;
    const script = make('script', { src: `index/${asked}.js` });
    const done = (how) => {
      if (how) loaded += 1; else failed += 1;
      script.remove();
      const isLast = loaded + failed === portions;
      // Often enough to be seen, seldom enough to cost little.
      if (loaded + failed === 1 || isLast || performance.now() - seen > 1000) {
        seen = performance.now();
        if (loaded + failed === 1) fromAddress();
        fillClasses();
        const scrolled = shown > SHOWN;
        if (scrolled && !isLast) say(); else search();
      } else say();
      load();
    };
    script.onload = () => done(true);
    script.onerror = () => done(false);
    document.head.append(script);
  };
  form.hidden = false;
  byId('bar').hidden = false;
  for (let parallel = 0; parallel < 4; parallel += 1) load();
})();

'use strict';
// The values of a plot under the pointer, or at the angle that the arrow keys choose.
(() => {
  const NEAR = 12, STEPS = 90;
  const written = (value, decimals) => value.toFixed(decimals).replace('-', '−');
  const numbers = (text) => text.split(' ').map(Number);
  const places = (path) => [...path.getAttribute('d').matchAll(/([ML])([-\d.]+) ([-\d.]+)/g)].map(([, step, x, y]) => [step, Number(x), Number(y)]);

  /** The height of a line at x, in the drawing; null beside it. */
  const heightAt = (points, x) => {
    for (let i = 1; i < points.length; i += 1) {
      const [[, x0, y0], [step, x1, y1]] = [points[i - 1], points[i]];
      if (step === 'L' && x >= x0 && x <= x1) return x1 > x0 ? y0 + (y1 - y0) * (x - x0) / (x1 - x0) : y0;
    }
    return null;
  };

  window.matdbPlot = (svg) => {
    const [xLow, xHigh, left, right] = numbers(svg.dataset.x), [yLow, yHigh, bottom, top] = numbers(svg.dataset.y);
    const parts = [...svg.querySelectorAll('path[data-name]')].map((path) => ({ name: path.dataset.name, isLine: path.classList.contains('line'), isLimit: path.classList.contains('mark'), points: places(path) }));
    const lines = parts.filter(({ isLine }) => isLine), marks = parts.filter(({ isLine }) => !isLine);
    const across = (x) => xLow + (xHigh - xLow) * (x - left) / (right - left);
    const upward = (y) => yLow + (yHigh - yLow) * (bottom - y) / (bottom - top);
    const unit = svg.querySelector('.label')?.textContent.includes('°') ? '°' : '';
    const cursor = document.createElementNS(svg.namespaceURI, 'path');
    cursor.setAttribute('class', 'cursor');
    const readout = document.createElement('p');
    readout.className = 'readout';
    readout.hidden = true;
    readout.setAttribute('role', 'status');
    svg.append(cursor);
    svg.after(readout);
    svg.tabIndex = 0;
    let chosen = null;

    const show = (x, y) => {
      chosen = Math.min(Math.max(x, left), right);
      const said = [`${written(across(chosen), 1)}${unit}`];
      for (const { name, points } of lines) {
        const height = heightAt(points, chosen);
        if (height !== null) said.push(`${name} ${written(upward(height), 1)}`);
      }
      let best = NEAR, nearest = null;
      for (const mark of y === undefined ? [] : marks) {
        for (const [, markX, markY] of mark.points) {
          const away = Math.hypot(markX - x, markY - y);
          if (away < best) [best, nearest] = [away, { mark, markX, markY }];
        }
      }
      if (nearest) said.push(`${nearest.mark.name}, ${nearest.mark.isLimit ? 'limit' : 'point'} at ${written(across(nearest.markX), 1)}${unit}: ${written(upward(nearest.markY), 1)}`);
      cursor.setAttribute('d', `M${chosen.toFixed(1)} ${top}V${bottom}`);
      readout.textContent = said.join(' · ');
      readout.hidden = false;
    };
    const hide = () => {
      chosen = null;
      cursor.removeAttribute('d');
      readout.hidden = true;
    };
    svg.addEventListener('pointermove', (event) => {
      const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      if (place.x < left - NEAR || place.x > right + NEAR) hide(); else show(place.x, place.y);
    });
    svg.addEventListener('pointerleave', ({ pointerType }) => { if (pointerType !== 'touch') hide(); });
    svg.addEventListener('blur', hide);
    svg.addEventListener('keydown', (event) => {
      const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (event.key === 'Escape') hide();
      if (!way) return;
      event.preventDefault();
      show(chosen === null ? left : chosen + way * (right - left) / STEPS);
    });
  };
  document.querySelectorAll('svg.plot').forEach(window.matdbPlot);
})();

// Looks at series over time: the same interval in every panel, zoomed and moved by wheel, drag,
// fingers, keys and buttons. Reads the data beside each still picture and puts itself in its place;
// without this script, and on paper, the still picture is what is seen.
(() => {
'use strict';
const NS = 'http://www.w3.org/2000/svg';
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

// --- data ---------------------------------------------------------------------------------------

// Little-endian whole numbers out of base64, mapped onto from..to; the lowest 16-bit one is a gap.
function numbers(text, wide, from, to) {
  const raw = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const at = new DataView(raw.buffer);
  const step = wide ? 4 : 2;
  const out = new Float64Array(raw.length / step);
  for (let k = 0; k < out.length; k++) {
    if (wide) {
      out[k] = from + at.getUint32(4 * k, true) / 4294967295 * (to - from);
    } else {
      const q = at.getInt16(2 * k, true);
      out[k] = q === -32768 ? NaN : from + (q + 32767) / 65534 * (to - from);
    }
  }
  return out;
}

function decoded(view) {
  if (view.times) return view;
  view.times = numbers(view.t.data, true, view.t.from, view.t.to);
  view.begins = new Uint8Array(view.times.length + 1);
  for (const k of view.breaks) view.begins[k] = 1;
  for (const panel of view.panels) {
    for (const line of panel.lines) line.y = numbers(line.data, false, line.from, line.to);
  }
  return view;
}

// First index whose time is at least t. Times rise.
function first(times, t) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] < t) low = middle + 1; else high = middle;
  }
  return low;
}

// --- axes ---------------------------------------------------------------------------------------

// Round numbers along an axis: about as many as wanted, and two at least.
function ticks(from, to, wanted) {
  let raw = (to - from) / Math.max(wanted, 1);
  for (;;) {
    const decade = Math.pow(10, Math.floor(Math.log10(raw)));
    const step = [1, 2, 5, 10].find(f => f * decade >= raw * 0.999) * decade;
    const k0 = Math.ceil(from / step - 1e-9), k1 = Math.floor(to / step + 1e-9);
    if (k1 <= k0 && raw > (to - from) / 20) { raw /= 2; continue; }
    const decimals = clamp(Math.ceil(-Math.log10(step) - 1e-9), 0, 9);
    const out = [];
    for (let k = k0; k <= k1; k++) {
      const value = k === 0 ? 0 : k * step;
      out.push([value, value.toFixed(decimals).replace('-', '\u2212')]);
    }
    return out;
  }
}

function shown(value, span) {
  const decimals = clamp(Math.ceil(-Math.log10(span)) + 3, 0, 9);
  return Number.isFinite(value) ? value.toFixed(decimals).replace('-', '\u2212') : '\u2013';
}

// --- drawing ------------------------------------------------------------------------------------

function put(parent, name, attributes, text) {
  const e = document.createElementNS(NS, name);
  for (const key in attributes) e.setAttribute(key, attributes[key]);
  if (text !== undefined) e.textContent = text;
  parent.appendChild(e);
  return e;
}

// A path through samples i0..i1. Where many share a column of pixels, its smallest and its largest
// are drawn in their order, so that a spike of one sample stays.
function path(view, y, i0, i1, x, py, dense) {
  let d = '', open = false;
  const point = (px, value) => {
    d += (open ? 'L' : 'M') + px.toFixed(1) + ' ' + py(value).toFixed(1);
    open = true;
  };
  if (!dense) {
    for (let i = i0; i < i1; i++) {
      if (view.begins[i]) open = false;
      if (Number.isFinite(y[i])) point(x(view.times[i]), y[i]); else open = false;
    }
    return d;
  }
  let column = NaN, low = -1, high = -1;
  const flush = () => {
    if (low < 0) return;
    point(column, y[Math.min(low, high)]);
    if (low !== high) point(column, y[Math.max(low, high)]);
    low = high = -1;
  };
  for (let i = i0; i < i1; i++) {
    const at = Math.round(x(view.times[i]));
    if (at !== column || view.begins[i]) {
      flush();
      column = at;
      if (view.begins[i]) open = false;
    }
    if (!Number.isFinite(y[i])) { flush(); open = false; continue; }
    if (low < 0 || y[i] < y[low]) low = i;
    if (high < 0 || y[i] > y[high]) high = i;
  }
  flush();
  return d;
}

class Viewer {
  constructor(figure, data) {
    this.figure = figure;
    this.data = data;
    this.pointers = new Map();
    this.view = decoded(data.views[0]);
    this.range = this.whole();
    this.build();
    figure.classList.add('live');
    new ResizeObserver(() => this.later()).observe(this.plot);
    this.draw();
  }

  whole() {
    const { from, to } = this.view.t;
    return to > from ? [from, to] : [from - 0.5, from + 0.5];
  }

  build() {
    const box = document.createElement('div');
    box.className = 'viewer';
    const bar = box.appendChild(document.createElement('div'));
    bar.className = 'bar';
    if (this.data.views.length > 1) {
      const choice = bar.appendChild(document.createElement('select'));
      choice.setAttribute('aria-label', 'what is shown');
      this.data.views.forEach((view, k) => choice.add(new Option(view.name, k)));
      // a narrow screen cuts a long choice
      const whole = box.appendChild(document.createElement('p'));
      whole.className = 'what';
      whole.textContent = this.view.name;
      choice.onchange = () => {
        const before = this.whole(), range = this.range;
        this.view = decoded(this.data.views[+choice.value]);
        whole.textContent = this.view.name;
        const after = this.whole();
        const same = Math.abs(before[0] - after[0]) + Math.abs(before[1] - after[1])
          < 0.2 * (after[1] - after[0]);
        this.go(same ? range : after);
      };
    }
    const button = (text, label, act) => {
      const b = bar.appendChild(document.createElement('button'));
      b.type = 'button';
      b.textContent = text;
      b.setAttribute('aria-label', label);
      b.title = label;
      b.onclick = act;
    };
    button('+', 'zoom in', () => this.zoom(0.5));
    button('\u2212', 'zoom out', () => this.zoom(2));
    button('\u2190', 'earlier', () => this.move(-0.25));
    button('\u2192', 'later', () => this.move(0.25));
    button('all', 'show everything', () => this.go(this.whole()));
    const keys = box.appendChild(document.createElement('div'));
    const names = new Map();
    for (const panel of this.data.views[0].panels) {
      for (const line of panel.lines) names.set(line.name, line.style);
      if (panel.limits) names.set('limit', 'limit');
    }
    for (const [name, style] of names) {
      const key = keys.appendChild(document.createElement('span'));
      key.className = 'key';
      const sample = put(key, 'svg', { width: 28, height: 10, 'aria-hidden': 'true' });
      put(sample, 'path', { class: 'l ' + style, d: 'M0 5H28' });
      key.append(name);
    }
    this.plot = box.appendChild(document.createElement('div'));
    this.plot.className = 'plot';
    this.plot.tabIndex = 0;
    this.plot.setAttribute('role', 'application');
    this.plot.setAttribute('aria-label', this.data.label
      + '. Plus and minus zoom, arrow keys move, 0 or Home shows everything.');
    this.told = box.appendChild(document.createElement('p'));
    this.told.className = 'range';
    this.told.setAttribute('role', 'status');
    const hint = box.appendChild(document.createElement('p'));
    hint.className = 'hint';
    hint.textContent = 'Drag over an interval to zoom into it, Shift and drag to move it. Click, then turn '
      + 'the wheel, or pinch; keys + \u2212 \u2190 \u2192, and 0 or a double click for everything. '
      + 'All panels show the same time.';
    this.figure.appendChild(box);
    this.listen();
  }

  // --- what moves the interval ---

  go([from, to]) {
    const [low, high] = this.whole();
    const least = Math.max((high - low) * 1e-5, 3 * (high - low) / Math.max(this.view.times.length, 4));
    const span = clamp(to - from, Math.min(least, high - low), high - low);
    const middle = clamp(0.5 * (from + to), low + 0.5 * span, high - 0.5 * span);
    this.range = [middle - 0.5 * span, middle + 0.5 * span];
    this.later();
  }

  zoom(factor, at) {
    const [from, to] = this.range;
    const c = at === undefined ? 0.5 * (from + to) : at;
    this.go([c - (c - from) * factor, c + (to - c) * factor]);
  }

  move(share) {
    const d = share * (this.range[1] - this.range[0]);
    this.go([this.range[0] + d, this.range[1] + d]);
  }

  // Time under a place of the window.
  at(clientX) {
    const box = this.plot.getBoundingClientRect();
    const share = (clientX - box.left - this.left) / (this.right - this.left);
    return this.range[0] + clamp(share, 0, 1) * (this.range[1] - this.range[0]);
  }

  listen() {
    const plot = this.plot;
    plot.addEventListener('keydown', e => {
      const acts = {
        '+': () => this.zoom(0.5), '=': () => this.zoom(0.5), '-': () => this.zoom(2),
        ArrowLeft: () => this.move(-0.2), ArrowRight: () => this.move(0.2),
        '0': () => this.go(this.whole()), Home: () => this.go(this.whole()),
      };
      if (e.ctrlKey || e.metaKey || e.altKey || !acts[e.key]) return;
      e.preventDefault();
      acts[e.key]();
    });
    // The page scrolls under a wheel until the plot is chosen by a click or by Ctrl.
    plot.addEventListener('wheel', e => {
      if (document.activeElement !== plot && !e.ctrlKey) return;
      e.preventDefault();
      const lines = e.deltaMode === 1 ? 16 : e.deltaMode === 2 ? 400 : 1;
      this.zoom(Math.exp(clamp(e.deltaY * lines, -400, 400) * 0.0025), this.at(e.clientX));
    }, { passive: false });
    plot.addEventListener('dblclick', () => this.go(this.whole()));
    plot.addEventListener('pointerdown', e => {
      if (e.button > 0) return;
      if (e.pointerType !== 'touch') { e.preventDefault(); plot.focus({ preventScroll: true }); }
      plot.setPointerCapture(e.pointerId);
      this.pointers.set(e.pointerId, e.clientX);
      this.begun = { range: this.range, x: [...this.pointers.values()], pan: e.shiftKey || e.pointerType === 'touch' };
    });
    plot.addEventListener('pointermove', e => {
      this.over = this.at(e.clientX);
      if (this.pointers.has(e.pointerId) && this.begun) {
        this.pointers.set(e.pointerId, e.clientX);
        const now = [...this.pointers.values()], was = this.begun.x;
        const [from, to] = this.begun.range;
        const perPx = (to - from) / (this.right - this.left);
        const left = plot.getBoundingClientRect().left + this.left;
        if (now.length === 2 && was.length === 2) {
          // The times under two fingers stay under them.
          const [a, b] = was.map(x => from + (x - left) * perPx);
          const px = now[1] - now[0];
          if (Math.abs(px) > 4) {
            const scale = (b - a) / px;
            if (scale > 0) this.go([a - (now[0] - left) * scale, a + (this.right - this.left - now[0] + left) * scale]);
          }
        } else if (this.begun.pan) {
          const d = (was[0] - now[0]) * perPx;
          this.go([from + d, to + d]);
        } else {
          this.picked = [was[0], now[0]].map(x => this.at(x)).sort((a, b) => a - b);
        }
      }
      this.later();
    });
    const end = e => {
      if (!this.pointers.delete(e.pointerId)) return;
      const far = this.begun && Math.abs(e.clientX - this.begun.x[0]) > 5;
      if (this.picked && far && e.type === 'pointerup') this.go(this.picked);
      this.picked = undefined;
      this.begun = this.pointers.size
        ? { range: this.range, x: [...this.pointers.values()], pan: true } : undefined;
      this.later();
    };
    plot.addEventListener('pointerup', end);
    plot.addEventListener('pointercancel', end);
    plot.addEventListener('pointerleave', () => { this.over = undefined; this.later(); });
  }

  // --- what is seen ---

  later() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.draw(); });
  }

  draw() {
    const width = Math.max(this.plot.clientWidth, 240);
    const [from, to] = this.range;
    const { view } = this;
    this.left = width < 500 ? 46 : 58;
    this.right = width - 10;
    const x = t => this.left + (t - from) / (to - from) * (this.right - this.left);
    const i0 = Math.max(first(view.times, from) - 1, 0);
    const i1 = Math.min(first(view.times, to) + 1, view.times.length);
    const dense = i1 - i0 > 2 * (this.right - this.left);
    const over = this.over === undefined ? -1 : this.nearest(this.over);
    const svg = document.createElementNS(NS, 'svg');
    const below = ticks(from, to, (this.right - this.left) / 80);
    let top = 0;
    view.panels.forEach((panel, k) => {
      const last = k + 1 === view.panels.length || !view.panels[k + 1].small;
      top += panel.small ? 20 : 24;
      const height = panel.small ? 72 : 132;
      this.panel(svg, panel, { x, top, height, i0, i1, dense, over, below, last });
      top += height + (last ? 20 : 0);
    });
    put(svg, 'text', { x: 0.5 * (this.left + this.right), y: top + 14, 'text-anchor': 'middle' },
      this.data.over + ' [' + this.data.unit + ']');
    const height = top + 22;
    if (this.picked) {
      const a = x(this.picked[0]);
      put(svg, 'rect', { class: 'pick', x: a, y: 0, width: x(this.picked[1]) - a, height: top });
    }
    if (over >= 0) {
      const at = x(view.times[over]);
      put(svg, 'path', { class: 'cursor', d: `M${at} 0V${top - 20}` });
    }
    svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
    svg.setAttribute('height', height);
    svg.setAttribute('aria-hidden', 'true');
    this.plot.replaceChildren(svg);
    const { unit } = this.data;
    const digits = to - from;
    const words = `Shown: ${shown(from, digits)} to ${shown(to, digits)} ${unit}`
      + (over >= 0 ? `; cursor at ${shown(view.times[over], digits)} ${unit}` : '');
    if (over >= 0) this.told.removeAttribute('role'); else this.told.setAttribute('role', 'status');
    if (this.told.textContent !== words) this.told.textContent = words;
    this.figure.dataset.from = from;
    this.figure.dataset.to = to;
  }

  nearest(t) {
    const { times } = this.view;
    const k = clamp(first(times, t), 0, times.length - 1);
    return k > 0 && t - times[k - 1] < times[k] - t ? k - 1 : k;
  }

  panel(svg, panel, { x, top, height, i0, i1, dense, over, below, last }) {
    const { view, left, right } = this;
    let low = Infinity, high = -Infinity;
    for (const { y } of panel.lines) {
      for (let i = i0; i < i1; i++) {
        if (y[i] < low) low = y[i];
        if (y[i] > high) high = y[i];
      }
    }
    const heading = put(svg, 'text', { x: left, y: top - 6 });
    if (panel.name) put(heading, 'tspan', { 'font-weight': 'bold' }, panel.name + '\u2002');
    put(heading, 'tspan', {}, `${panel.quantity} [${panel.unit}]`);
    put(svg, 'rect', { class: 'frame', x: left, y: top, width: right - left, height });
    if (!(low <= high)) return;
    if (panel.small) { high = Math.max(-low, high); low = -high; }
    for (const limit of panel.limits || []) {
      if (Math.abs(limit) < 2.2 * Math.max(-low, high)) {
        low = Math.min(low, limit);
        high = Math.max(high, limit);
      }
    }
    const room = 0.06 * (high - low) || 0.1 * Math.abs(high) || 1;
    low -= room;
    high += room;
    const py = value => top + height - (value - low) / (high - low) * height;
    const inside = put(svg, 'svg', { x: left, y: top, width: right - left, height,
      viewBox: `${left} ${top} ${right - left} ${height}` });
    for (const [value, text] of ticks(low, high, panel.small ? 3 : 5)) {
      const at = py(value);
      put(inside, 'path', { class: value === 0 ? 'zero' : 'grid', d: `M${left} ${at}H${right}` });
      put(svg, 'text', { class: 'n', x: left - 5, y: at + 3.5, 'text-anchor': 'end' }, text);
    }
    for (const [value, text] of below) {
      const at = x(value);
      put(inside, 'path', { class: 'grid', d: `M${at} ${top}V${top + height}` });
      if (last) put(svg, 'text', { class: 'n', x: at, y: top + height + 14, 'text-anchor': 'middle' }, text);
    }
    for (const limit of panel.limits || []) {
      put(inside, 'path', { class: 'limit', d: `M${left} ${py(limit)}H${right}` });
    }
    // the model's wide line lies lowest, the measured one on top of all
    const rank = line => ({ model: 0, measured: 2 })[line.style] ?? 1;
    const order = [...panel.lines].sort((a, b) => rank(a) - rank(b));
    for (const line of order) {
      put(inside, 'path', { class: 'l ' + line.style, d: path(view, line.y, i0, i1, x, py, dense) });
    }
    if (over >= 0) {
      // each number behind the name of its line; on a narrow screen inside the panel, below its heading
      const named = line => `${line.name} ${shown(line.y[over], high - low)}`;
      const words = `${panel.lines.map(named).join(', ')} ${panel.unit}`;
      const wide = right - left > 6.5 * words.length + 150;
      put(svg, 'text', { class: 'over', x: right - (wide ? 0 : 4), y: top + (wide ? -6 : 12), 'text-anchor': 'end' },
        words);
    }
  }
}

for (const script of document.querySelectorAll('script.traces')) {
  new Viewer(script.closest('figure'), JSON.parse(script.textContent));
}
})();

// A timeline: lanes over time, to be zoomed and asked. What it reads is described in reports/lane_data.py.

function made(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

// Times in seconds, each counted from 0, of columns of microseconds from one entry to the next.
function addedUp(stepsUs) {
  let us = 0;
  return Float64Array.from(stepsUs, (step) => { us += step; return us / 1e6; });
}

function readData(text) {
  const data = JSON.parse(text);
  for (const { bars, marks, steps } of data.lanes) {
    bars.start = addedUp(bars.start);
    bars.end = bars.start.map((startS, i) => startS + bars.took[i] / 1e6);
    marks.at = addedUp(marks.at);
    for (const step of steps) step.at = addedUp(step.at);
  }
  return data;
}

class Timeline {
  constructor(place) {
    this.data = readData(document.getElementById(place.dataset.timeline).textContent);
    this.view = new View(this.data.end_s, () => this.later());
    this.plot = new Plot(this.data, this.view);
    this.found = null;
    this.held = false;
    this.waiting = false;
    this.build(place);
    this.listen();
    this.resize();
  }

  build(place) {
    this.range = made('output', { class: 'range', 'aria-label': 'shown' });
    this.tools = made('div', { class: 'tools' });
    for (const [name, label, act] of [
      ['+', 'Zoom in', () => this.view.zoom(0.5, this.middle())],
      ['−', 'Zoom out', () => this.view.zoom(2, this.middle())],
      ['←', 'Earlier', () => this.view.pan(-0.4 * this.view.spanS)],
      ['→', 'Later', () => this.view.pan(0.4 * this.view.spanS)],
      ['All', 'Show all', () => this.view.reset()],
    ]) {
      const button = made('button', { type: 'button', 'aria-label': label, title: label }, name);
      button.addEventListener('click', act);
      this.tools.append(button);
    }
    this.tools.append(this.range);
    this.box = made('div', { class: 'lanes', tabindex: '0', role: 'application', 'aria-label': place.getAttribute('aria-label') });
    this.cross = made('div', { class: 'cross', hidden: '' }, made('span'));
    this.axes = [made('canvas', { class: 'axis', 'aria-hidden': 'true' }), made('canvas', { class: 'axis', 'aria-hidden': 'true' })];
    this.canvases = [];
    this.box.append(this.axes[0], ...this.data.lanes.map((lane) => this.lane(lane)), this.axes[1], this.cross);
    this.tip = made('div', { class: 'tip', hidden: '' });
    this.said = made('div', { class: 'said', 'aria-live': 'polite' });
    const help = made('p', { class: 'hint' },
      'Drag to move; wheel after a click, Ctrl + wheel or pinch to zoom. Keys: + − zoom, ← → move, 0 all, ↑ ↓ lane, ',
      ', . bar before and after.');
    place.replaceChildren(this.tools, this.box, help, this.tip, this.said);
    this.place = place;
  }

  lane(lane) {
    const canvas = made('canvas', { 'aria-hidden': 'true' });
    const fold = made('button', { type: 'button', class: 'fold', 'aria-expanded': String(!lane.folded) }, lane.title);
    const legend = made('span', { class: 'legend' }, ...lane.legend.map((number) => this.swatch(number)));
    const section = made('div', { class: 'lane', 'data-lane': lane.name }, made('div', { class: 'lane-head' }, fold, legend), canvas);
    canvas.hidden = lane.folded;
    legend.hidden = lane.folded;
    fold.addEventListener('click', () => {
      lane.folded = !lane.folded;
      fold.setAttribute('aria-expanded', String(!lane.folded));
      canvas.hidden = lane.folded;
      legend.hidden = lane.folded;
      this.later();
    });
    this.canvases.push(canvas);
    return section;
  }

  swatch(number) {
    const [words, colour, shape] = this.data.kinds[number];
    const canvas = made('canvas', { class: 'swatch', width: '28', height: '20', 'aria-hidden': 'true' });
    canvas.paint = (colours) => {
      const ctx = canvas.getContext('2d');
      ctx.setTransform(2, 0, 0, 2, 0, 0);
      ctx.clearRect(0, 0, 14, 10);
      const look = colours[colour] ?? colour;
      if (shape) {
        drawShape(ctx, shape, 7, 5, 10, look, colours.ink);
      } else {
        ctx.fillStyle = look;
        ctx.fillRect(0, 1, 14, 8);
      }
    };
    return made('span', { class: 'kind' }, canvas, words);
  }

  listen() {
    listenWheel(this.box, this.plot, () => document.activeElement === this.box);
    listenPointers(this.box, this.plot, {
      look: (event) => this.look(event, 5),
      choose: (event) => this.choose(event),
      away: () => this.away(),
    });
    listenKeys(this.box, this.plot, {
      chosenTime: () => (this.held && this.found ? this.found.startS : null),
      stepLane: (by) => this.stepLane(by),
      stepBar: (by) => this.stepBar(by),
      clear: () => this.clear(),
    });
    new ResizeObserver(() => this.resize()).observe(this.box);
    document.addEventListener('themechange', () => {
      this.plot.colours = palette();
      this.later();
    });
    // Paper is light, and does not wait for the next frame.
    matchMedia('print').addEventListener('change', () => {
      this.plot.colours = palette();
      this.draw();
    });
    document.addEventListener('pointerdown', (event) => { if (!this.place.contains(event.target)) this.clear(); });
  }

  resize() {
    if (this.box.clientWidth === this.plot.width) return;
    this.plot.resize(this.box.clientWidth);
    this.later();
  }

  // Once a frame is enough, however many events ask for it.
  later() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  draw() {
    const { view, plot } = this;
    for (const axis of this.axes) plot.axis(axis);
    this.data.lanes.forEach((lane, i) => {
      if (!lane.folded) plot.lane(this.canvases[i], lane, this.found && this.found.lane === lane ? this.found : null);
    });
    for (const swatch of this.box.querySelectorAll('.swatch')) swatch.paint(plot.colours);
    const step = tickStep(view.spanS, plot.width, 200) / 10;
    this.range.textContent = `${clock(view.fromS, step, view.endS)} – ${clock(view.toS, step, view.endS)}`;
    this.box.dataset.from = view.fromS;
    this.box.dataset.to = view.toS;
    this.box.dataset.wide = plot.width - plot.left;
  }

  middle() { return this.held && this.found ? this.found.startS : (this.view.fromS + this.view.toS) / 2; }

  look(event, near) {
    const x = eventX(this.box, event);
    this.crossAt(x);
    const found = this.at(event, near);
    if (this.held && !found) return;
    this.held = false;
    this.tell(found, event.clientX, event.clientY);
  }

  choose(event) {
    const found = this.at(event, event.pointerType === 'touch' ? 14 : 5);
    this.crossAt(eventX(this.box, event));
    this.held = Boolean(found);
    this.tell(found, event.clientX, event.clientY);
  }

  away() {
    this.cross.hidden = true;
    if (!this.held) this.tell(null);
  }

  clear() {
    this.held = false;
    this.cross.hidden = true;
    this.tell(null);
  }

  crossAt(x) {
    const shown = x >= this.plot.left && x <= this.plot.width;
    this.cross.hidden = !shown;
    if (!shown) return;
    this.cross.style.left = `${x}px`;
    const step = tickStep(this.view.spanS, this.plot.width, 200) / 20;
    this.cross.firstChild.textContent = clock(this.plot.time(x), step, this.view.endS);
    this.cross.classList.toggle('flip', x > this.plot.width - 80);
  }

  // The bar, mark or step nearest to an event, within so many pixels.
  at(event, near) {
    const number = this.canvases.findIndex((canvas) => !canvas.hidden && isOver(canvas, event.clientY));
    if (number < 0 || eventX(this.box, event) < this.plot.left) return null;
    const y = event.clientY - this.canvases[number].getBoundingClientRect().top;
    return nearest(this.data.lanes[number], this.plot, eventX(this.box, event), y, near);
  }

  tell(found, x, y) {
    const changed = found?.index !== this.found?.index || found?.lane !== this.found?.lane || found?.what !== this.found?.what;
    this.found = found;
    if (changed) this.later();
    this.tip.hidden = !found;
    if (!found) return;
    const [head, ...lines] = this.data.texts[found.text].split('\n');
    const kind = this.data.kinds[found.kind][0];
    const step = Math.min(tickStep(this.view.spanS, this.plot.width, 200) / 20, 0.1);
    const from = clock(found.startS, step, this.view.endS);
    const span = found.endS > found.startS ? `${from} – ${clock(found.endS, step, this.view.endS)}, ${length(found.endS - found.startS)}` : from;
    this.tip.replaceChildren(made('strong', {}, head), ...lines.map((line) => made('div', {}, line)),
      made('div', { class: 'when' }, kind && !head.startsWith(kind) ? `${kind}, ${span}` : span));
    placeTip(this.tip, this.place, x, y);
  }

  stepLane(by) {
    const open = this.data.lanes.filter((lane) => !lane.folded && lane.bars.start.length + lane.marks.at.length);
    if (!open.length) return;
    const now = this.found ? open.indexOf(this.found.lane) : by > 0 ? -1 : open.length;
    const lane = open[Math.min(Math.max(now + by, 0), open.length - 1)];
    const timeS = this.found ? this.found.startS : this.view.fromS;
    this.pick(inOrder(lane).reduce((best, thing) => (Math.abs(thing.startS - timeS) < Math.abs(best.startS - timeS) ? thing : best)));
  }

  stepBar(by) {
    if (!this.found) { this.stepLane(1); return; }
    const things = inOrder(this.found.lane);
    const now = things.findIndex((t) => t.what === this.found.what && t.index === this.found.index);
    this.pick(things[Math.min(Math.max(now + by, 0), things.length - 1)]);
  }

  pick(found) {
    this.held = true;
    this.view.reveal(found.startS, found.endS);
    const canvas = this.canvases[this.data.lanes.indexOf(found.lane)];
    canvas.scrollIntoView({ block: 'nearest' });
    const at = canvas.getBoundingClientRect();
    const x = Math.min(Math.max(this.plot.x(found.startS), this.plot.left), this.plot.width);
    this.tell(found, at.left + x, at.top + this.plot.places(found.lane)[found.row].bottom);
    this.later();
    this.said.textContent = `${found.lane.title}: ${this.tip.innerText.replaceAll('\n', ', ')}`;
  }
}

function isOver(element, y) {
  const at = element.getBoundingClientRect();
  return y >= at.top && y <= at.bottom;
}

function thing(lane, what, index) {
  if (what === 'bar') {
    const { start, end, row, kind, text } = lane.bars;
    return { lane, what, index, startS: start[index], endS: end[index], row: row[index], kind: kind[index], text: text[index] };
  }
  const { at, row, kind, text } = lane.marks;
  return { lane, what, index, startS: at[index], endS: at[index], row: row[index], kind: kind[index], text: text[index] };
}

function inOrder(lane) {
  const things = [
    ...Array.from(lane.bars.start, (_, i) => thing(lane, 'bar', i)),
    ...Array.from(lane.marks.at, (_, i) => thing(lane, 'mark', i)),
  ];
  return things.sort((one, two) => one.startS - two.startS || one.row - two.row);
}

function nearest(lane, plot, x, y, near) {
  const rows = plot.places(lane);
  const down = (row) => Math.max(rows[row].top - y, y - rows[row].bottom, 0);
  let best = null;
  let least = near;
  // Marks lie above bars, and later bars above earlier ones.
  for (let i = lane.marks.at.length - 1; i >= 0; i -= 1) {
    const far = Math.max(Math.abs(plot.x(lane.marks.at[i]) - x) - 5, 0) + down(lane.marks.row[i]);
    if (far < least) { least = far; best = ['mark', i]; }
  }
  for (let i = lane.bars.start.length - 1; i >= 0; i -= 1) {
    const far = Math.max(plot.x(lane.bars.start[i]) - x, x - plot.x(lane.bars.end[i]), 0) + down(lane.bars.row[i]);
    if (far < least) { least = far; best = ['bar', i]; }
  }
  if (best) return thing(lane, ...best);
  for (const step of lane.steps) {
    if (down(step.row) > 0) continue;
    const timeS = plot.time(x);
    const index = step.at.findLastIndex((t) => t <= timeS);
    if (index < 0) continue;
    const endS = step.at[index + 1] ?? plot.view.endS;
    return { lane, what: 'step', index, startS: step.at[index], endS, row: step.row, kind: step.kind, text: step.text[index] };
  }
  return null;
}

function placeTip(tip, place, x, y) {
  const frame = place.getBoundingClientRect();
  const room = document.documentElement.clientWidth;
  const wide = tip.offsetWidth;
  const left = Math.min(Math.max(x + 14, 6), Math.max(room - wide - 6, 6));
  const below = y + 18 + tip.offsetHeight < innerHeight;
  tip.style.left = `${left - frame.left}px`;
  tip.style.top = `${(below ? y + 18 : y - tip.offsetHeight - 12) - frame.top}px`;
}

for (const place of document.querySelectorAll('.timeline')) new Timeline(place);

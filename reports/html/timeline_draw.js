// Drawing of lanes on canvases. Bars that would fall on the same pixel are drawn once: 20,000 cost no more than a few
// hundred.

const NARROW_PX = 560;
const INDENT_PX = 9;
const NAME_PX = 13;
const MERGE_PX = 0.4;
const FONT = '11px ';

// The page's colours and font, as the theme has them now.
function palette() {
  const style = getComputedStyle(document.documentElement);
  const found = {};
  for (const name of ['ink', 'paper', 'muted', 'rule', 'shade', 'dark-band', 'violet', 'forest']) {
    found[name] = style.getPropertyValue(`--${name}`).trim();
  }
  found.font = FONT + style.getPropertyValue('--sans');
  return found;
}

// How many of some times in order are not after a time.
function firstAfter(times, timeS) {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= timeS) low = middle + 1;
    else high = middle;
  }
  return low;
}

function colourOf(kind, colours) { return colours[kind[1]] ?? kind[1]; }

// Give a canvas the size of its box in the screen's own pixels.
function fitCanvas(canvas, width, height) {
  const ratio = window.devicePixelRatio || 1;
  const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== w || canvas.height !== h) {
    canvas.width = w;
    canvas.height = h;
    canvas.style.height = `${height}px`;
  }
  const ctx = canvas.getContext('2d');
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  ctx.clearRect(0, 0, width, height);
  return ctx;
}

// Where each row of a lane begins and ends [pixel]; `above` each named row there is room for its name.
function rowPlaces(lane, above) {
  let y = 2;
  return lane.rows.map((row) => {
    const top = y + (row.name ? above : 0);
    y = top + row.height;
    return { top, bottom: y, height: row.height };
  });
}

// Room left of the axis for names of rows; none on a narrow screen, where they stand above the rows.
function gutterWidth(lanes, width, colours) {
  if (width < NARROW_PX) return 0;
  const ctx = document.createElement('canvas').getContext('2d');
  ctx.font = colours.font;
  let widest = 0;
  for (const lane of lanes) {
    for (const row of lane.rows) {
      widest = Math.max(widest, ctx.measureText(row.name).width + row.depth * INDENT_PX);
    }
  }
  return Math.min(Math.ceil(widest) + 12, Math.round(width * 0.32));
}

class Plot {
  constructor(data, view) {
    this.data = data;
    this.view = view;
    this.colours = palette();
    this.width = 0;
    this.left = 0;
  }

  resize(width) {
    this.width = width;
    this.left = gutterWidth(this.data.lanes, width, this.colours);
  }

  places(lane) { return rowPlaces(lane, this.left ? 0 : NAME_PX); }

  x(timeS) { return this.left + ((timeS - this.view.fromS) / this.view.spanS) * (this.width - this.left); }

  time(x) { return this.view.fromS + ((x - this.left) / (this.width - this.left)) * this.view.spanS; }

  lane(canvas, lane, chosen) {
    const rows = this.places(lane);
    const height = rows[rows.length - 1].bottom + 3;
    const ctx = fitCanvas(canvas, this.width, height);
    ctx.font = this.colours.font;
    this.grid(ctx, rows, height);
    ctx.save();
    ctx.beginPath();
    ctx.rect(this.left, 0, this.width - this.left, height);
    ctx.clip();
    this.bands(ctx, lane, height);
    this.guides(ctx, height);
    this.bars(ctx, lane, rows);
    for (const step of lane.steps) this.step(ctx, step, rows[step.row]);
    ctx.restore();
    this.marks(ctx, lane, rows);
    if (chosen) this.chosen(ctx, rows[chosen.row], chosen);
    this.names(ctx, lane, rows);
  }

  grid(ctx, rows, height) {
    ctx.fillStyle = this.colours.shade;
    rows.forEach((row, i) => {
      if (i % 2 === 0 && rows.length > 1 && row.height > 10) {
        ctx.fillRect(this.left, row.top, this.width - this.left, row.height);
      }
    });
    ctx.fillStyle = this.colours.rule;
    for (const timeS of this.ticks()) ctx.fillRect(Math.round(this.x(timeS)), 0, 1, height);
    ctx.fillRect(this.left, 0, this.width - this.left, 1);
  }

  ticks() {
    const step = tickStep(this.view.spanS, this.width - this.left, 76);
    const found = [];
    for (let n = Math.ceil(this.view.fromS / step - 1e-9); n * step <= this.view.toS * (1 + 1e-12); n += 1) {
      found.push(n * step);
    }
    return found;
  }

  axis(canvas) {
    const ctx = fitCanvas(canvas, this.width, 22);
    const step = tickStep(this.view.spanS, this.width - this.left, 76);
    ctx.font = this.colours.font;
    ctx.textBaseline = 'top';
    for (const timeS of this.ticks()) {
      const x = this.x(timeS);
      const text = clock(timeS, step, this.view.endS);
      const half = ctx.measureText(text).width / 2;
      ctx.fillStyle = this.colours.muted;
      ctx.fillRect(Math.round(x), 0, 1, 4);
      ctx.fillText(text, Math.min(Math.max(x - half, this.left), this.width - 2 * half), 6);
    }
  }

  bands(ctx, lane, height) {
    for (const [startS, endS, kind] of lane.bands) {
      ctx.fillStyle = colourOf(this.data.kinds[kind], this.colours);
      ctx.fillRect(this.x(startS), 0, Math.max(this.x(endS) - this.x(startS), 1), height);
    }
  }

  guides(ctx, height) {
    ctx.strokeStyle = '#009E73';
    ctx.lineWidth = 1;
    ctx.setLineDash([3, 3]);
    ctx.beginPath();
    for (const timeS of this.data.guides) {
      const x = Math.round(this.x(timeS)) + 0.5;
      ctx.moveTo(x, 0);
      ctx.lineTo(x, height);
    }
    ctx.stroke();
    ctx.setLineDash([]);
  }

  bars(ctx, lane, rows) {
    const { start, end, row, kind } = lane.bars;
    const kinds = this.data.kinds.length;
    // By row and kind: the last stretch [pixel]; what begins where it ends goes on with it.
    const from = new Float64Array(lane.rows.length * kinds).fill(NaN);
    const to = new Float64Array(from.length);
    const colours = this.data.kinds.map((look) => colourOf(look, this.colours));
    const paint = (place) => {
      if (Number.isNaN(from[place])) return;
      const { top, height } = rows[Math.floor(place / kinds)];
      const pad = Math.min(height * 0.15, 2);
      ctx.fillStyle = colours[place % kinds];
      ctx.fillRect(from[place], top + pad, Math.max(to[place] - from[place], 0.9), height - 2 * pad);
    };
    const [left, right] = [this.left - 2, this.width + 2];
    const last = firstAfter(start, this.view.toS);
    for (let i = 0; i < last; i += 1) {
      if (end[i] < this.view.fromS) continue;
      const place = row[i] * kinds + kind[i];
      const x = Math.max(this.x(start[i]), left);
      const until = Math.min(this.x(end[i]), right);
      if (x - to[place] > MERGE_PX || Number.isNaN(from[place])) {
        paint(place);
        from[place] = x;
        to[place] = until;
      } else if (until > to[place]) {
        to[place] = until;
      }
    }
    from.forEach((_, place) => paint(place));
    this.seams(ctx, lane, rows, last);
  }

  // A hair between bars that touch, where there is room to see that they are two.
  seams(ctx, lane, rows, until) {
    const { start, end, row } = lane.bars;
    const wide = (this.view.spanS / this.width) * 5;
    const last = new Map();
    ctx.fillStyle = this.colours.paper;
    for (let i = 0; i < until; i += 1) {
      if (end[i] < this.view.fromS || end[i] - start[i] < wide) continue;
      if (last.get(row[i]) === start[i] && rows[row[i]].height > 6) {
        ctx.fillRect(this.x(start[i]) - 0.5, rows[row[i]].top + 2, 1, rows[row[i]].height - 4);
      }
      last.set(row[i], end[i]);
    }
  }

  step(ctx, step, { bottom: base, height }) {
    const [left, right] = [this.left - 2, this.width + 2];
    const end = Math.min(this.x(this.view.endS), right);
    ctx.beginPath();
    ctx.moveTo(left, base);
    let [y, peak, x] = [base, base, left];
    for (let i = 0; i < step.at.length; i += 1) {
      const next = Math.min(Math.max(this.x(step.at[i]), left), right);
      // Of the values on one pixel the greatest is drawn, and the last.
      if (next - x >= MERGE_PX) {
        if (peak < y) ctx.lineTo(x, peak);
        ctx.lineTo(x, y);
        ctx.lineTo(next, y);
        [x, peak] = [next, base];
      }
      y = base - step.share[i] * height;
      peak = Math.min(peak, y);
    }
    if (peak < y) ctx.lineTo(x, peak);
    ctx.lineTo(x, y);
    ctx.lineTo(end, y);
    ctx.lineWidth = 1.5;
    ctx.strokeStyle = colourOf(this.data.kinds[step.kind], this.colours);
    ctx.stroke();
    ctx.lineTo(end, base);
    ctx.globalAlpha = 0.22;
    ctx.fillStyle = ctx.strokeStyle;
    ctx.fill();
    ctx.globalAlpha = 1;
  }

  marks(ctx, lane, rows) {
    const { at, row, kind } = lane.marks;
    for (let i = 0; i < at.length; i += 1) {
      if (at[i] < this.view.fromS || at[i] > this.view.toS) continue;
      const { top, height } = rows[row[i]];
      const look = this.data.kinds[kind[i]];
      drawShape(ctx, look[2], this.x(at[i]), top + height / 2, height, colourOf(look, this.colours), this.colours.ink);
    }
  }

  chosen(ctx, place, found) {
    ctx.strokeStyle = this.colours.ink;
    ctx.lineWidth = 2;
    const from = Math.max(this.x(found.startS) - 1, this.left);
    const to = Math.min(this.x(found.endS) + 1, this.width - 1);
    const height = Math.max(place.height, 5);
    if (to >= from) ctx.strokeRect(from, place.top + 0.5, Math.max(to - from, 2), height - 1);
  }

  names(ctx, lane, rows) {
    const nested = lane.rows.some((row) => row.depth > 0);
    ctx.textBaseline = 'middle';
    lane.rows.forEach((row, i) => {
      const { top, height } = rows[i];
      const y = this.left ? top + Math.max(height, 11) / 2 + 0.5 : top - NAME_PX / 2 + 1;
      if (row.name) this.name(ctx, row.name, row.depth * INDENT_PX, y, nested);
      for (const [share, word] of row.ticks ?? []) this.name(ctx, word, 0, top + (1 - share) * height, false);
    });
  }

  // Left of the axis, those of a tree from its root; above the row, with a rim, on a narrow screen.
  name(ctx, text, indent, y, nested) {
    ctx.fillStyle = this.colours.ink;
    if (this.left > 0) {
      const room = this.left - 10 - indent;
      const wide = Math.min(ctx.measureText(text).width, room);
      ctx.fillText(shortened(ctx, text, room), nested ? 2 + indent : this.left - 8 - wide, y);
      return;
    }
    ctx.lineWidth = 3;
    ctx.lineJoin = 'round';
    ctx.strokeStyle = this.colours.paper;
    ctx.strokeText(text, 3 + indent, y);
    ctx.fillText(text, 3 + indent, y);
  }
}

function shortened(ctx, text, room) {
  if (ctx.measureText(text).width <= room) return text;
  let kept = text;
  while (kept.length > 1 && ctx.measureText(`${kept}…`).width > room) kept = kept.slice(0, -1);
  return `${kept}…`;
}

const SHAPES = {
  star: (r) => [...Array(10).keys()].map((i) => {
    const at = (Math.PI * i) / 5 - Math.PI / 2;
    const far = i % 2 ? r * 0.45 : r * 1.15;
    return [far * Math.cos(at), far * Math.sin(at)];
  }),
  diamond: (r) => [[0, -r], [r, 0], [0, r], [-r, 0]],
  up: (r) => [[0, -r], [r, r * 0.8], [-r, r * 0.8]],
  down: (r) => [[0, r], [r, -r * 0.8], [-r, -r * 0.8]],
};

function drawShape(ctx, shape, x, y, height, colour, ink) {
  const r = Math.min(Math.max(height * 0.36, 2.5), 6.5);
  ctx.fillStyle = colour;
  ctx.strokeStyle = colour;
  ctx.lineWidth = 1.6;
  ctx.beginPath();
  if (shape === 'cross') {
    ctx.moveTo(x - r, y - r); ctx.lineTo(x + r, y + r); ctx.moveTo(x + r, y - r); ctx.lineTo(x - r, y + r);
    ctx.stroke();
  } else if (shape in SHAPES) {
    SHAPES[shape](r).forEach(([dx, dy], i) => (i ? ctx.lineTo(x + dx, y + dy) : ctx.moveTo(x + dx, y + dy)));
    ctx.closePath();
    ctx.fill();
    ctx.lineWidth = 0.8;
    ctx.strokeStyle = ink;
    if (shape !== 'star') ctx.stroke();
  } else if (shape === 'circle') {
    ctx.arc(x, y, r * 0.8, 0, 2 * Math.PI);
    ctx.fill();
  } else {
    ctx.fillRect(x - 0.9, y - height * 0.4, 1.8, height * 0.8);
  }
}

// The timeline's axis: which times are shown, where they are drawn, and how they are written.

const STEPS_S = [
  0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800,
  3600, 7200, 14400, 28800, 86400,
];
const LEAST_SPAN_S = 0.05;

// The distance of ticks [s] so that each has at least `room` pixels.
function tickStep(spanS, width, room) {
  const least = (spanS * room) / Math.max(width, 1);
  return STEPS_S.find((step) => step >= least) ?? STEPS_S[STEPS_S.length - 1] * Math.ceil(least / 86400);
}

// A time as 4:05 or 1:04:05, with as many decimals as the step needs.
function clock(timeS, stepS, longS) {
  const decimals = stepS >= 1 ? 0 : Math.min(3, Math.ceil(-Math.log10(stepS) - 1e-9));
  const unit = 10 ** decimals;
  const whole = Math.round(Math.abs(timeS) * unit);
  const seconds = (whole % (60 * unit)) / unit;
  const minutes = Math.floor(whole / (60 * unit));
  const width = decimals ? 3 + decimals : 2;
  const tail = seconds.toFixed(decimals).padStart(width, '0');
  const sign = timeS < 0 && whole > 0 ? '-' : '';
  if (longS >= 3600) return `${sign}${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, '0')}:${tail}`;
  return `${sign}${minutes}:${tail}`;
}

// A length of time in words.
function length(timeS) {
  if (timeS < 0.9995) return `${Number((timeS * 1000).toPrecision(3))} ms`;
  if (timeS < 120) return `${Number(timeS.toPrecision(3))} s`;
  const seconds = Math.round(timeS);
  return `${Math.floor(seconds / 60)} min ${seconds % 60} s`;
}

// The range of time that is shown; never less than LEAST_SPAN_S and never outside the run.
class View {
  constructor(endS, changed) {
    this.endS = endS;
    this.fromS = 0;
    this.toS = endS;
    this.changed = changed;
  }

  get spanS() { return this.toS - this.fromS; }

  show(fromS, toS) {
    const span = Math.min(Math.max(toS - fromS, Math.min(LEAST_SPAN_S, this.endS)), this.endS);
    const middle = (fromS + toS) / 2;
    const from = Math.min(Math.max(middle - span / 2, 0), this.endS - span);
    if (from === this.fromS && from + span === this.toS) return;
    this.fromS = from;
    this.toS = from + span;
    this.changed();
  }

  // Narrow (factor below 1) or widen what is shown round a time that stays where it is.
  zoom(factor, aboutS) {
    const span = Math.min(Math.max(this.spanS * factor, Math.min(LEAST_SPAN_S, this.endS)), this.endS);
    const share = (aboutS - this.fromS) / this.spanS;
    this.show(aboutS - share * span, aboutS + (1 - share) * span);
  }

  pan(byS) { this.show(this.fromS + byS, this.toS + byS); }

  reset() { this.show(0, this.endS); }

  // So that a stretch can be seen whole, or its middle.
  reveal(startS, endS) {
    if (startS >= this.fromS && endS <= this.toS) return;
    const middle = (startS + endS) / 2;
    const half = Math.max(this.spanS, (endS - startS) * 1.2) / 2;
    this.show(middle - half, middle + half);
  }
}

// What a reader does to a timeline: mouse, pen, fingers and keys change its view or choose a bar.

const WHEEL = 0.0016;
const KEY_ZOOM = 0.6;
const KEY_PAN = 0.2;
const DRAG_PX = 4;

// The wheel zooms once the reader has clicked into the timeline, or with Ctrl (as a pinch on a touch pad does):
// before, it scrolls the page, which may be long.
function listenWheel(box, plot, inside) {
  box.addEventListener('wheel', (event) => {
    const sideways = Math.abs(event.deltaX) > Math.abs(event.deltaY) || event.shiftKey;
    if (!sideways && !event.ctrlKey && !event.metaKey && !inside()) return;
    event.preventDefault();
    const unit = event.deltaMode === 1 ? 16 : 1;
    if (sideways) {
      plot.view.pan((((event.deltaX || event.deltaY) * unit) / (plot.width - plot.left)) * plot.view.spanS);
      return;
    }
    // A pinch comes in small steps.
    const speed = event.ctrlKey && Math.abs(event.deltaY) < 50 ? WHEEL * 6 : WHEEL;
    plot.view.zoom(Math.exp(event.deltaY * unit * speed), plot.time(eventX(box, event)));
  }, { passive: false });
}

function eventX(box, event) { return event.clientX - box.getBoundingClientRect().left; }

// One pointer drags what is shown, two pinch it, a tap chooses; a pointer that only hovers looks.
function listenPointers(box, plot, act) {
  const down = new Map();
  let moved = false;
  let grip = null;

  const seize = () => {
    const at = [...down.values()].map((p) => p.x);
    grip = at.map((x) => plot.time(x));
  };

  box.addEventListener('pointerdown', (event) => {
    if (event.button !== 0 || event.target.closest('button')) return;
    moved = down.size > 0;
    down.set(event.pointerId, { x: eventX(box, event), y: event.clientY });
    box.focus({ preventScroll: true });
    seize();
  });

  box.addEventListener('pointermove', (event) => {
    const x = eventX(box, event);
    const held = down.get(event.pointerId);
    if (!held) {
      if (event.pointerType !== 'touch') act.look(event);
      return;
    }
    if (down.size === 1 && !moved && Math.abs(x - held.x) < DRAG_PX) return;
    if (!moved) {
      moved = true;
      box.setPointerCapture(event.pointerId);
      act.away();
    }
    held.x = x;
    dragTo(plot, [...down.values()].map((p) => p.x), grip);
  });

  const up = (event) => {
    if (!down.delete(event.pointerId)) return;
    if (!moved && event.type === 'pointerup') act.choose(event);
    if (down.size > 0) seize();
  };
  box.addEventListener('pointerup', up);
  box.addEventListener('pointercancel', up);
  box.addEventListener('pointerleave', () => { if (!down.size) act.away(); });
}

// Show such a range that the times that were seized lie under the pointers.
function dragTo(plot, xs, times) {
  const wide = plot.width - plot.left;
  const share = (x) => (x - plot.left) / wide;
  if (xs.length === 1 || times.length === 1) {
    const from = times[0] - share(xs[0]) * plot.view.spanS;
    plot.view.show(from, from + plot.view.spanS);
  } else if (Math.abs(xs[1] - xs[0]) > 8) {
    const perPx = (times[1] - times[0]) / (xs[1] - xs[0]);
    const span = perPx * wide;
    if (span > 0) plot.view.show(times[0] - share(xs[0]) * span, times[0] + (1 - share(xs[0])) * span);
  }
}

// Keys, told under the timeline.
function listenKeys(box, plot, act) {
  const { view } = plot;
  const middle = () => act.chosenTime() ?? (view.fromS + view.toS) / 2;
  const keys = {
    '+': () => view.zoom(KEY_ZOOM, middle()),
    '=': () => view.zoom(KEY_ZOOM, middle()),
    '-': () => view.zoom(1 / KEY_ZOOM, middle()),
    '_': () => view.zoom(1 / KEY_ZOOM, middle()),
    0: () => view.reset(),
    Home: () => view.show(0, view.spanS),
    End: () => view.show(view.endS - view.spanS, view.endS),
    ArrowLeft: () => view.pan(-KEY_PAN * view.spanS),
    ArrowRight: () => view.pan(KEY_PAN * view.spanS),
    ArrowUp: () => act.stepLane(-1),
    ArrowDown: () => act.stepLane(1),
    ',': () => act.stepBar(-1),
    '.': () => act.stepBar(1),
    Escape: () => act.clear(),
  };
  box.addEventListener('keydown', (event) => {
    if (event.target !== box || event.ctrlKey || event.metaKey || event.altKey || !(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  });
}

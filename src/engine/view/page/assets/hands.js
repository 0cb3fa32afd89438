// What turns a view, by mouse, fingers and keys, and what explains its colors.

// `later` draws soon, `home` sets the first view; `click`, if given, receives a place on the canvas that was pointed at.
function turnable(view, later, home, click) {
  const { canvas } = view, hands = new Map();
  let pressed = null;
  const spread = () => {
    const [a, b] = [...hands.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  const zoom = (factor) => {
    view.zoom = Math.min(Math.max(view.zoom * factor, 0.2), 60);
    later();
  };
  const turn = (yaw, pitch) => {
    view.yaw += yaw;
    view.pitch = Math.min(Math.max(view.pitch + pitch, -1.57), 1.57);
    later();
  };
  const move = (dx, dy) => {
    const unit = Math.hypot(...view.extent) / canvas.clientHeight / view.zoom;
    view.shift[0] += dx * unit;
    view.shift[1] -= dy * unit;
    later();
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    hands.set(event.pointerId, { x: event.clientX, y: event.clientY });
    pressed = hands.size === 1 && event.button === 0 ? [event.clientX, event.clientY] : null;
  });
  canvas.addEventListener("pointermove", (event) => {
    const hand = hands.get(event.pointerId);
    if (!hand) return;
    const before = hands.size === 2 ? spread() : 0;
    const [dx, dy] = [event.clientX - hand.x, event.clientY - hand.y];
    Object.assign(hand, { x: event.clientX, y: event.clientY });
    if (pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) pressed = null;
    if (hands.size === 2) {
      move(dx / 2, dy / 2);
      return zoom(spread() / (before || 1));
    }
    if (event.shiftKey || event.buttons === 2 || event.buttons === 4) return move(dx, dy);
    turn(-dx * 0.008, dy * 0.008);
  });
  canvas.addEventListener("pointerup", (event) => {
    if (pressed && hands.size === 1 && click) {
      const box = canvas.getBoundingClientRect();
      click(pressed[0] - box.left, pressed[1] - box.top);
    }
    pressed = null;
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => hands.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-event.deltaY * 0.0015));
  }, { passive: false });
  const reset = () => {
    home();
    later();
  };
  canvas.addEventListener("dblclick", reset);
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const [x, y] = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] || [0, 0];
    const size = { "+": 1.2, "=": 1.2, "-": 1 / 1.2 }[event.key];
    if (x || y) event.shiftKey ? move(-40 * x, -40 * y) : turn(0.1 * x, 0.1 * y);
    else if (size) zoom(size);
    else if (event.key === "Home") reset();
    else if (event.key === "Enter" && click) click(canvas.clientWidth / 2, canvas.clientHeight / 2);
    else return;
    event.preventDefault();
  });
}

// A scale with the values of its ends.
function ramp(box, [least, most], beyond) {
  const stops = Array.from({ length: 11 }, (_, k) => css(scale(k / 10))).join(", ");
  const bar = make("span", { className: "bar" });
  bar.style.background = `linear-gradient(90deg, ${stops})`;
  box.append(number(least, 3), bar, number(most, 3) + (beyond ? " and more" : ""));
}

// The names of what is colored by number.
function kindsOf(color) {
  return {
    subdomain: data.subdomains.map((s) => [s.id, String(s.id)]),
    region: data.regions.filter((r) => r.filled).map((r) => [r.region, r.name || String(r.region)]),
    label: data.labels.map((name, i) => [i, name]),
  }[color];
}

function swatch(n) {
  const square = make("i", {});
  square.style.background = css(kind(n));
  return square;
}

function swatches(box, names) {
  for (const [n, name] of names.slice(0, 16)) box.append(make("span", {}, swatch(n), name));
  if (names.length > 16) box.append(`… ${count(names.length)}`);
}

// What lessons that live in a page share: runs of compiled kernels, plots, a sphere that one can turn, and one loop over frames.
"use strict";

const STILL = matchMedia("(prefers-reduced-motion: reduce)");
const DARK = matchMedia("(prefers-color-scheme: dark)");
const $ = (selector, within = document) => within.querySelector(selector);
const $$ = (selector, within = document) => [...within.querySelectorAll(selector)];
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const clamp = (x, lo, hi) => Math.min(hi, Math.max(lo, x));

/** A number as people write it: 0.0123, 1.2 x 10^-7, 12 300. */
function shown(x, digits = 3) {
  if (!Number.isFinite(x)) return x > 0 ? "∞" : x < 0 ? "−∞" : "not a number";
  if (x === 0) return "0";
  const size = Math.abs(x), sign = x < 0 ? "−" : "";
  if (size >= 1e-3 && size < 1e5) {
    const text = size.toPrecision(Math.max(digits, size >= 1 ? Math.floor(Math.log10(size)) + 1 : digits));
    return sign + text.replace(/\B(?=(\d{3})+(?!\d))(?<!\.\d*)/g, " ");
  }
  const [mantissa, exponent] = size.toExponential(digits - 1).split("e");
  return `${sign}${mantissa} × 10${raised(Number(exponent))}`;
}
/** So many things: 1 step, 12 300 steps. */
const counted = (n, thing) => `${shown(Math.round(n), 1)} ${thing}${Math.round(n) === 1 ? "" : "s"}`;
const raised = (k) => String(k).replace(/[-\d]/g, (c) => c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]);

/** A method at work: its kernel, with a state that goes from call to call. */
class Run {
  constructor(method) {
    this.method = method;
    this.stride = method.directions + 1;
    this.length = method.state.length;
    this.S = new Float64Array(method.kernel.size);
    this.P = Float64Array.from(method.par);
    this.W = Float64Array.from(method.weights);
    this.R = new Float64Array(8);
    this.none = new Float64Array(this.length);
  }
  /** Begin at a state, with step h; tangents are as many vectors as the kernel has directions. */
  begin(state, h, tangents = []) {
    Object.assign(this, { h, steps: 0, status: 0 });
    for (let i = 0; i < this.length; i++) {
      this.S[i * this.stride] = state[i];
      tangents.forEach((vector, k) => { this.S[i * this.stride + 1 + k] = vector[i]; });
    }
    this.method.kernel.start(this.S, h, this.P, this.R);
    this.status = this.R[4];
    return this;
  }
  get t() { return this.steps * this.h; }
  value(i) { return this.S[i * this.stride]; }
  tangent(i, k) { return this.S[i * this.stride + 1 + k]; }
  state(into = new Float64Array(this.length)) {
    for (let i = 0; i < this.length; i++) into[i] = this.S[i * this.stride];
    return into;
  }
  /** Take n steps, or as many as there are; rows of every so many of them go into T. */
  advance(n, every = 0, T = this.none) {
    if (this.status || n < 1) { this.rows = 0; return 0; }
    this.method.kernel.integrate(this.S, this.h, n, every || -1, every, T, this.P, this.W, this.R);
    this.steps += this.R[0];
    this.status = this.R[4];
    this.rows = this.R[1];
    return this.R[0];
  }
  /** The largest error of the energy since this was last asked. */
  worst() {
    const at = this.method.kernel.errors, value = this.S[at];
    this.S[at] = 0;
    return value;
  }
}

/** One loop over frames for all screens: those that are seen and not paused move. */
const Frames = {
  screens: [], last: 0, rate: 60,
  add(element, tick) {
    const screen = { element, tick, seen: false, playing: !STILL.matches };
    new IntersectionObserver((entries) => { screen.seen = entries.at(-1).isIntersecting; }, { rootMargin: "40px" }).observe(element);
    const button = $("[data-play]", element);
    const label = () => { if (button) { button.textContent = screen.playing ? "Pause" : "Play"; button.setAttribute("aria-pressed", String(screen.playing)); } };
    if (button) button.addEventListener("click", () => { screen.playing = !screen.playing; label(); });
    screen.play = (on) => { screen.playing = on; label(); };
    label();
    this.screens.push(screen);
    return screen;
  },
  start() {
    const frame = (now) => {
      const dt = Math.min(0.1, (now - this.last) / 1000);
      if (this.last && dt > 0) this.rate += 0.05 * (1 / dt - this.rate);
      this.last = now;
      for (const screen of this.screens) if (screen.seen && screen.playing && !document.hidden) screen.tick(dt);
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  },
};

/** A canvas that is as sharp as the screen and as wide as its place, and is drawn anew when either changes. */
class Picture {
  constructor(canvas, draw) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    this.paint = draw;
    new ResizeObserver(() => this.fit()).observe(canvas);
    DARK.addEventListener("change", () => this.draw());
  }
  fit() {
    const ratio = window.devicePixelRatio || 1, box = this.canvas.getBoundingClientRect();
    const width = Math.round(box.width * ratio), height = Math.round(box.height * ratio);
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    this.width = box.width; this.height = box.height;
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.draw();
  }
  draw() {
    if (!this.width) return;
    this.pen.clearRect(0, 0, this.width, this.height);
    this.pen.font = '13px "Helvetica Neue", Helvetica, Arial, "Liberation Sans", sans-serif';
    this.paint(this.pen, this.width, this.height);
  }
}

/** Decades, or round numbers, between two ends. */
function ticks(lo, hi, log, most = 6) {
  if (log) {
    const first = Math.ceil(Math.log10(lo) - 1e-9), last = Math.floor(Math.log10(hi) + 1e-9), step = Math.ceil((last - first + 1) / most);
    return Array.from({ length: Math.floor((last - first) / step) + 1 }, (_, k) => first + k * step)
      .map((k) => [10 ** k, Math.abs(k) < 3 ? String(Number((10 ** k).toPrecision(1))) : `10${raised(k)}`]);
  }
  const rough = (hi - lo) / most, power = 10 ** Math.floor(Math.log10(rough)), step = [1, 2, 5, 10].find((f) => f * power >= rough) * power;
  const values = [];
  for (let x = Math.ceil(lo / step - 1e-9) * step; x <= hi + 1e-9 * step; x += step) values.push(Math.abs(x) < 1e-9 * step ? 0 : x);
  return values.map((x) => [x, String(Number(x.toPrecision(6))).replace("-", "−")]);
}

const LEFT = 62, RIGHT = 14; // room beside the axes of a plot, px

/** Axes with labels, units and curves; a curve is { x, y, colour, dash, dots, name, width }. */
class Plot extends Picture {
  constructor(canvas, options) {
    super(canvas, (pen, width, height) => this.axes(pen, width, height));
    this.options = options;
    this.curves = []; // named ones stand in a legend: above the axes, or with rows: true in them, at the bottom
    this.marks = [];
  }
  place(width, height, above) {
    const { x, y } = this.options, left = LEFT, right = width - RIGHT, top = 26 + above, bottom = 42;
    const scale = ({ lo, hi, log }, from, to) => {
      const a = log ? Math.log10(lo) : lo, b = log ? Math.log10(hi) : hi;
      return (v) => from + (clamp(((log ? Math.log10(Math.max(v, 1e-300)) : v) - a) / (b - a), -0.02, 1.02)) * (to - from);
    };
    return { left, top, right, bottom: height - bottom, X: scale(x, left, right), Y: scale(y, height - bottom, top) };
  }
  axes(pen, width, height) {
    const rows = this.named(pen, width), above = this.options.rows ? 0 : 17 * (rows.length - 1);
    const { x, y } = this.options, box = this.place(width, height, above), ink = colour("--ink"), hair = colour("--hair");
    pen.lineWidth = 1; pen.fillStyle = ink; pen.textAlign = "center"; pen.textBaseline = "top";
    for (const [value, text] of ticks(x.lo, x.hi, x.log, Math.max(2, Math.floor((box.right - box.left) / 70)))) {
      line(pen, [[box.X(value), box.top], [box.X(value), box.bottom]], hair);
      pen.fillText(text, box.X(value), box.bottom + 5);
    }
    pen.textAlign = "right"; pen.textBaseline = "middle";
    for (const [value, text] of ticks(y.lo, y.hi, y.log, Math.max(2, Math.floor((box.bottom - box.top) / 30)))) {
      line(pen, [[box.left, box.Y(value)], [box.right, box.Y(value)]], hair);
      pen.fillText(text, box.left - 6, box.Y(value));
    }
    line(pen, [[box.left, box.top], [box.left, box.bottom], [box.right, box.bottom]], colour("--quiet"));
    pen.textAlign = "left"; pen.textBaseline = "bottom"; pen.fillText(y.label, 4, box.top - 7);
    pen.textAlign = "right"; pen.fillText(x.label, box.right, height - 4);
    pen.textAlign = "right"; pen.textBaseline = "bottom";
    rows.forEach((row, k) => {
      const level = (this.options.rows ? box.bottom - 8 : box.top - 7) - 17 * k;
      let end = box.right;
      for (const { name, colour: trace } of row) {
        pen.fillStyle = ink; pen.fillText(name, end, level);
        end -= pen.measureText(name).width + 9;
        pen.fillStyle = trace; pen.fillRect(end - 10, level - 9, 14, 4);
        end -= 26;
      }
    });
    pen.save();
    pen.beginPath(); pen.rect(box.left, box.top - 2, box.right - box.left + 2, box.bottom - box.top + 4); pen.clip();
    for (const curve of this.curves) this.curve(pen, box, curve);
    pen.restore();
    for (const mark of this.marks) {
      const at = box.X(mark.x), flip = at > (box.left + box.right) / 2;
      pen.fillStyle = mark.colour; pen.textAlign = flip ? "right" : "left"; pen.textBaseline = "top";
      line(pen, [[at, box.top], [at, box.bottom]], mark.colour, [2, 3]);
      pen.fillText(mark.text, at + (flip ? -6 : 6), box.top + 3 + 16 * (mark.row || 0));
    }
  }
  /** The named curves, from the last, in rows upwards; the first row has none of them where there is no room beside the label. */
  named(pen, width) {
    const right = width - RIGHT;
    const fit = (room) => {
      const rows = [[]];
      let used = 0;
      for (const curve of this.curves.filter(({ name }) => name).reverse()) {
        const size = pen.measureText(curve.name).width + 35;
        if (used && used + size > room) { rows.push([]); used = 0; }
        rows.at(-1).push(curve);
        used += size;
      }
      return rows;
    };
    if (this.options.rows) return fit(right - LEFT);
    const beside = fit(right - pen.measureText(this.options.y.label).width);
    return beside.length > 1 ? [[], ...fit(right)] : beside;
  }
  curve(pen, box, { x, y, colour: ink, dash = [], dots = false, width = 2 }) {
    pen.strokeStyle = pen.fillStyle = ink; pen.lineWidth = width; pen.setLineDash(dash); pen.lineJoin = "round";
    pen.beginPath();
    for (let k = 0; k < x.length; k++) {
      const a = box.X(x[k]), b = box.Y(y[k]);
      if (dots) { pen.moveTo(a + 3, b); pen.arc(a, b, 3, 0, 7); } else if (k) pen.lineTo(a, b); else pen.moveTo(a, b);
    }
    if (dots) pen.fill(); else pen.stroke();
    pen.setLineDash([]);
  }
}

function line(pen, points, ink, dash = []) {
  pen.strokeStyle = ink; pen.setLineDash(dash); pen.beginPath();
  points.forEach(([a, b], k) => k ? pen.lineTo(a, b) : pen.moveTo(a, b));
  pen.stroke(); pen.setLineDash([]);
}

/** How a sphere is looked at; all pictures of a screen may share one. */
class View {
  constructor(azimuth = 0.6, elevation = 0.35) { Object.assign(this, { azimuth, elevation, watchers: [] }); }
  turn(a, b) {
    this.azimuth += a;
    this.elevation = clamp(this.elevation + b, -1.5, 1.5);
    this.watchers.forEach((tell) => tell());
  }
  /** To the right, upwards, and towards the eye. */
  seen(x, y, z) {
    const c = Math.cos(this.azimuth), s = Math.sin(this.azimuth), C = Math.cos(this.elevation), D = Math.sin(this.elevation);
    const u = c * x + s * y, v = -s * x + c * y;
    return [u, C * z + D * v, D * z - C * v];
  }
  /** The point of the unit sphere that is seen at a place, on the side of the eye. */
  back(right, up) {
    const size = Math.hypot(right, up), k = size > 0.999 ? 0.999 / size : 1, a = right * k, b = up * k;
    const near = Math.sqrt(Math.max(0, 1 - a * a - b * b)), C = Math.cos(this.elevation), D = Math.sin(this.elevation);
    const z = C * b + D * near, v = D * b - C * near, c = Math.cos(this.azimuth), s = Math.sin(this.azimuth);
    return [c * a - s * v, s * a + c * v, z];
  }
}

/** A sphere with what moves on it or leaves it: turned by dragging beside the bob, or with the arrow keys; dragging the bob is a new start. */
class Sphere extends Picture {
  constructor(canvas, view, { onStart = null, rod = true } = {}) {
    super(canvas, (pen, width, height) => this.globe(pen, width, height));
    Object.assign(this, { view, onStart, rod, bob: [0, 0, -1], trails: [], room: 1.12 });
    view.watchers.push(() => this.draw());
    canvas.tabIndex = 0;
    canvas.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!way) return;
      event.preventDefault();
      if (event.shiftKey && onStart) {
        const [right, up] = view.seen(...this.unit());
        onStart(view.back(right + 0.08 * way[0], up + 0.08 * way[1]));
      } else view.turn(0.1 * way[0], -0.1 * way[1]);
    });
    canvas.addEventListener("pointerdown", (event) => {
      const [right, up] = this.place(event), [a, b] = view.seen(...this.unit());
      const bob = onStart && Math.hypot(right - a, up - b) < 0.22;
      let last = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
      const move = (moved) => {
        if (bob) onStart(view.back(...this.place(moved)));
        else view.turn((last[0] - moved.clientX) * -0.01, (moved.clientY - last[1]) * 0.01);
        last = [moved.clientX, moved.clientY];
      };
      const end = () => { canvas.removeEventListener("pointermove", move); };
      canvas.addEventListener("pointermove", move);
      canvas.addEventListener("pointerup", end, { once: true });
      canvas.addEventListener("pointercancel", end, { once: true });
    });
  }
  unit() { const n = Math.hypot(...this.bob) || 1; return this.bob.map((x) => x / n); }
  radius() { return Math.min(this.width, this.height) / 2 / this.room; }
  place(event) {
    const box = this.canvas.getBoundingClientRect(), r = this.radius();
    return [(event.clientX - box.left - this.width / 2) / r, -(event.clientY - box.top - this.height / 2) / r];
  }
  globe(pen, width, height) {
    const r = this.radius(), at = ([right, up]) => [width / 2 + r * right, height / 2 - r * up];
    const quiet = colour("--quiet"), rule = colour("--rule"), ink = colour("--ink");
    pen.lineWidth = 1;
    for (const circle of graticule()) {
      const points = circle.map((x) => this.view.seen(...x));
      for (const front of [false, true]) {
        pen.strokeStyle = rule; pen.globalAlpha = front ? 0.9 : 0.3; pen.beginPath();
        points.forEach((point, k) => { if (k && (point[2] > 0) === front) { pen.moveTo(...at(points[k - 1])); pen.lineTo(...at(point)); } });
        pen.stroke();
      }
    }
    pen.globalAlpha = 1; pen.lineWidth = 1.2; pen.strokeStyle = quiet; pen.beginPath(); pen.arc(width / 2, height / 2, r, 0, 7); pen.stroke();
    for (const { points, count, colour: trace, dots } of this.trails) {
      pen.strokeStyle = pen.fillStyle = trace; pen.lineWidth = 1.8;
      for (let k = dots ? 0 : 1; k < count; k++) {
        const here = this.view.seen(points[3 * k], points[3 * k + 1], points[3 * k + 2]);
        pen.globalAlpha = (here[2] > 0 ? 0.85 : 0.3) * (dots ? 1 : 0.25 + 0.75 * k / count);
        pen.beginPath();
        if (dots) { pen.arc(...at(here), 1.7, 0, 7); pen.fill(); } else {
          pen.moveTo(...at(this.view.seen(points[3 * k - 3], points[3 * k - 2], points[3 * k - 1]))); pen.lineTo(...at(here)); pen.stroke();
        }
      }
    }
    pen.globalAlpha = 1;
    if (!this.bob.every(Number.isFinite)) return;
    const bob = at(this.view.seen(...this.bob));
    if (this.rod) { pen.lineWidth = 2; line(pen, [[width / 2, height / 2], bob], ink); pen.fillStyle = ink; pen.beginPath(); pen.arc(width / 2, height / 2, 3, 0, 7); pen.fill(); }
    pen.fillStyle = this.colour || ink; pen.strokeStyle = colour("--paper"); pen.lineWidth = 2;
    pen.beginPath(); pen.arc(...bob, 8, 0, 7); pen.fill(); pen.stroke();
  }
}

let circles = null;
/** Meridians and parallels. */
function graticule() {
  if (circles) return circles;
  const around = (f) => Array.from({ length: 61 }, (_, k) => f(k * Math.PI / 30));
  circles = [-0.5, 0, 0.5].map((z) => around((a) => [Math.sqrt(1 - z * z) * Math.cos(a), Math.sqrt(1 - z * z) * Math.sin(a), z]));
  for (let k = 0; k < 4; k++) circles.push(around((a) => [Math.cos(a) * Math.cos(k * Math.PI / 4), Math.cos(a) * Math.sin(k * Math.PI / 4), Math.sin(a)]));
  return circles;
}

/** The last so many points of a path in space. */
class Trail {
  constructor(most, trace, dots = false) { Object.assign(this, { points: new Float64Array(3 * most), most, count: 0, colour: trace, dots }); }
  add(x, y, z) {
    if (!(Math.abs(x) + Math.abs(y) + Math.abs(z) < 1e6)) return;
    if (this.count === this.most) { this.points.copyWithin(0, 3); this.count--; }
    this.points.set([x, y, z], 3 * this.count++);
  }
  clear() { this.count = 0; }
}

/** A slider or a list of a screen: its value as a number, or as text, whenever it changes. */
function control(element, name, tell, text = (x) => x) {
  const input = $(`[name="${name}"]`, element), output = input.parentElement.querySelector("output");
  const value = () => input.type === "range" ? Number(input.value) : input.value;
  const show = () => { if (output) { output.textContent = text(value()); input.setAttribute("aria-valuetext", text(value())); } };
  input.addEventListener("input", () => { show(); tell(value()); });
  show();
  return value;
}

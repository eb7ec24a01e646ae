"use strict";
const { methods, functions, colours, names } = DATA;
const start = { p: DATA.p0, q: DATA.q0 }, SPEED = Math.hypot(...DATA.p0);
const O = new Float64Array(1);
const across = (x) => { functions.Gv(x, DATA.problem, O); return Math.abs(O[0]); };
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const parts = (run) => { const x = run.state(); return { x, p: [...x.slice(0, 3)], q: [...x.slice(3)] }; };

/* momenta of both */
{
  const element = $("#hidden"), pair = ["shake", "rattle"], view = new View(0.5, 0.4), runs = {};
  const globe = new Sphere($("[data-globe]", element), view, { onStart: (q) => {
    const w = [-q[1], q[0], 0], size = Math.hypot(...w);
    start.q = q; start.p = size > 1e-3 ? w.map((x) => SPEED * x / size) : [SPEED, 0, 0]; again();
  } });
  const plot = new Plot($("[data-across]", element), { x: { lo: 0, hi: 10, label: "t [s]" }, y: { lo: 1e-17, hi: 1e1, log: true, label: "constraint on velocities, |G Hₚ| [m²/s]" }, rows: true });
  const trail = new Trail(200, colours.rattle);
  globe.trails = [trail]; globe.room = 1.5;
  const h = control(element, "h", () => again(), (k) => `${k / 100} s`);
  const MAGNIFIED = 100, globes = globe.globe.bind(globe);
  $("[data-magnified]", element).textContent = String(MAGNIFIED);
  globe.globe = (pen, width, height) => {
    globes(pen, width, height);
    const r = globe.radius(), at = (x) => { const [a, b] = view.seen(...x); return [width / 2 + r * a, height / 2 - r * b]; };
    for (const [name, wide] of [["rattle", 7], ["shake", 2.5]]) { // the wide one first: both are seen where they are one
      const { p, q } = parts(runs[name].run), out = dot(p, q) / dot(q, q);
      const tip = q.map((x, i) => x + 0.25 * (p[i] + (MAGNIFIED - 1) * out * x)), [a, b] = [at(q), at(tip)];
      const angle = Math.atan2(b[1] - a[1], b[0] - a[0]);
      pen.lineWidth = wide;
      line(pen, [a, b], colours[name]);
      line(pen, [[b[0] - 9 * Math.cos(angle - 0.5), b[1] - 9 * Math.sin(angle - 0.5)], b, [b[0] - 9 * Math.cos(angle + 0.5), b[1] - 9 * Math.sin(angle + 0.5)]], colours[name]);
    }
  };
  let wanted;
  function again() {
    wanted = 0; trail.clear(); plot.options.x.hi = 10;
    for (const name of pair) runs[name] = { run: new Run(methods[name]).begin([...start.p, ...start.q], h() / 100), most: 0, curve: { x: [], y: [], colour: colours[name], name: names[name] } };
    show();
  }
  function tick(dt) {
    wanted = Math.min(wanted + dt, 0.5);
    for (; wanted >= h() / 100; wanted -= h() / 100) for (const name of pair) {
      const { run, curve } = runs[name];
      if (!run.advance(1)) continue;
      const { x, q } = parts(run);
      if (name === "rattle") trail.add(...q);
      curve.x.push(run.t); curve.y.push(Math.max(across(x), 1e-17)); runs[name].most = Math.max(runs[name].most, across(x));
      if (run.t > plot.options.x.hi) plot.options.x.hi *= 1.5;
    }
    show();
  }
  function show() {
    const [shake, rattle] = pair.map((name) => parts(runs[name].run)), most = (name, digits) => shown(runs[name].most, digits);
    globe.bob = rattle.q; globe.draw();
    plot.curves = pair.map((name) => runs[name].curve); plot.draw();
    $("[data-meter]", element).textContent = `t = ${shown(runs.rattle.run.t, 3)} s · positions differ by ${shown(Math.hypot(...shake.q.map((x, i) => x - rattle.q[i])), 1)} m · largest |G Hₚ| so far: SHAKE ${most("shake", 2)}, RATTLE ${most("rattle", 1)} m²/s`;
  }
  again();
  Frames.add(element, tick);
  if (STILL.matches) for (let k = 0; k < 40; k++) tick(0.25);
}

/* the same at t = 10 s, for the sentence */
{
  const [shake, rattle] = ["shake", "rattle"].map((name) => { const run = new Run(methods[name]).begin([...DATA.p0, ...DATA.q0], 0.06); run.advance(167); return parts(run); });
  const out = dot(shake.p, shake.q) / dot(shake.q, shake.q);
  const off = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));
  globalThis.facts = { positions: off(shake.q, rattle.q), momenta: off(shake.p.map((x, i) => x - out * shake.q[i]), rattle.p), across: across(shake.x) };
  for (const key of ["positions", "momenta"]) $(`[data-fill="${key}"]`).textContent = shown(facts[key], 1);
}

/* orders */
{
  const element = $("#order"), plot = new Plot($("[data-orders]", element), { x: { log: true }, y: { lo: 1e-18, hi: 1e1, log: true, label: "error after 1 s" }, rows: true });
  const fine = new Run(methods[DATA.finest]).begin([...DATA.p0, ...DATA.q0], 1 / 400);
  fine.advance(400);
  const exact = fine.state(), points = Object.fromEntries(DATA.schemes.map((name) => [name, []]));
  const todo = [4, 6, 8, 11, 16, 32, 64, 128, 256, 512, 1024].flatMap((n) => DATA.schemes.map((name) => [name, n]));
  const dashes = { shake: [8, 6], lobatto4: [7, 3] }, of = control(element, "of", () => show());
  const against = control(element, "against", () => { if (STILL.matches) while (untimed.length) tick(); show(); });
  const labels = { h: "step h [s]", ms: "time of the run in this browser [ms]" }, untimed = [], ROUNDS = 3, LONG = 25;
  const begun = (name, n) => new Run(methods[name]).begin([...DATA.p0, ...DATA.q0], 1 / n);
  function tick() {
    if (todo.length) {
      const [name, n] = todo.shift(), run = begun(name, n);
      if (run.advance(n) !== n) return;
      points[name].push({ name, n, h: 1 / n, ms: Infinity, error: [0, 3].map((from) => Math.hypot(...[0, 1, 2].map((i) => run.value(from + i) - exact[from + i]))) });
      if (!todo.length) for (let k = 0; k < ROUNDS; k++) untimed.push(...Object.values(points).flat());
    } else if (untimed.length && against() === "ms") {
      timed(untimed.shift());
    } else {
      $("[data-play]", element).hidden = true;
      return;
    }
    show();
  }
  /** Repeat a run for some milliseconds, since clocks of browsers are coarse; of several such means the smallest counts. */
  function timed(point) {
    const began = performance.now();
    let runs = 0, ms = 0;
    for (; ms < LONG; ms = performance.now() - began, runs++) begun(point.name, point.n).advance(point.n);
    point.ms = Math.min(point.ms, ms / runs);
  }
  /** Slopes by least squares over the four finest points above rounding. */
  function slope(name) {
    const used = points[name].map((point) => [Math.log(point.h), Math.log(point.error[of() / 3])]).filter(([, y]) => y > Math.log(5e-13)).slice(-4);
    if (used.length < 2) return NaN;
    const [a, b] = [0, 1].map((i) => used.reduce((sum, point) => sum + point[i], 0) / used.length);
    return used.reduce((sum, [x, y]) => sum + (x - a) * (y - b), 0) / used.reduce((sum, [x]) => sum + (x - a) ** 2, 0);
  }
  function show() {
    plot.options.y.label = `error of ${Number(of()) ? "q [m]" : "p [N s]"} after 1 s`;
    const x = against(), known = Object.values(points).flat().map((point) => point[x]).filter(Number.isFinite);
    const [lo, hi] = x === "h" ? [5e-4, 0.3] : known.length ? [Math.min(...known) / 2, 2 * Math.max(...known)] : [1e-3, 1];
    Object.assign(plot.options.x, { label: labels[x], lo, hi });
    plot.curves = [...DATA.schemes].sort((a, b) => (a in dashes) - (b in dashes)).flatMap((name) => {
      const done = points[name].filter((point) => Number.isFinite(point[x])), curve = { x: done.map((point) => point[x]), y: done.map((point) => point.error[of() / 3]), colour: colours[name] };
      return [{ ...curve, dash: dashes[name], name: plot.width > 700 ? names[name] : names[name].split(",")[0] }, { ...curve, dots: true }];
    });
    plot.draw();
    const left = untimed.length, times = left ? `measuring: ${left} runs are left` : "each time is the smallest mean of several";
    $("[data-meter]", element).textContent = x === "ms" ? times : "slopes: " + DATA.schemes.map((name) => `${names[name].split(",")[0]} ${Number.isFinite(slope(name)) ? slope(name).toFixed(2) : "…"}`).join(" · ");
  }
  Frames.add(element, tick);
  show();
  if (STILL.matches) while (todo.length) tick();
  globalThis.orders = { points, slope, finish: () => { while (todo.length) tick(); return Object.fromEntries(DATA.schemes.map((name) => [name, slope(name)])); } };
}
Frames.start();

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
    for (const [name, width] of [["rattle", 7], ["shake", 2.5]]) { // the wide one first: both are seen where they are one
      const { p, q } = parts(runs[name].run), out = dot(p, q) / dot(q, q);
      const tip = q.map((x, i) => x + 0.25 * (p[i] + (MAGNIFIED - 1) * out * x)), [a, b] = [at(q), at(tip)];
      const angle = Math.atan2(b[1] - a[1], b[0] - a[0]);
      pen.lineWidth = width;
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
  const element = $("#order"), plot = new Plot($("[data-orders]", element), { x: { lo: 5e-4, hi: 0.3, log: true, label: "step h [s]" }, y: { lo: 1e-18, hi: 1e1, log: true, label: "error after 1 s" }, rows: true });
  const fine = new Run(methods[DATA.finest]).begin([...DATA.p0, ...DATA.q0], 1 / 400);
  fine.advance(400);
  const exact = fine.state(), points = Object.fromEntries(DATA.schemes.map((name) => [name, []]));
  const todo = [4, 6, 8, 11, 16, 32, 64, 128, 256, 512, 1024].flatMap((n) => DATA.schemes.map((name) => [name, n]));
  const dashes = { shake: [8, 6], lobatto4: [7, 3] }, of = control(element, "of", () => show()), against = control(element, "against", () => show());
  const axes = { h: { lo: 5e-4, hi: 0.3, label: "step h [s]" }, ms: { lo: 2e-4, hi: 3, label: "steps times the shortest time of a step here [ms]" } };
  const ROUNDS = 6, TIMED = 20, STEPS = 128, step = Object.fromEntries(DATA.schemes.map((name) => [name, NaN]));
  const untimed = Array(ROUNDS).fill(DATA.schemes).flat();
  const begun = (name, n) => new Run(methods[name]).begin([...DATA.p0, ...DATA.q0], 1 / n);
  function tick() {
    if (todo.length) {
      const [name, n] = todo.shift(), run = begun(name, n);
      if (run.advance(n) !== n) return;
      points[name].push({ h: 1 / n, error: [0, 3].map((from) => Math.hypot(...[0, 1, 2].map((i) => run.value(from + i) - exact[from + i]))) });
    } else if (untimed.length) {
      const name = untimed.shift(), began = performance.now();
      for (let k = 0; k < TIMED; k++) begun(name, STEPS).advance(STEPS);
      const ms = (performance.now() - began) / TIMED / STEPS;
      step[name] = ms < step[name] || Number.isNaN(step[name]) ? ms : step[name];
    } else {
      $("[data-play]", element).hidden = true;
      return;
    }
    show();
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
    Object.assign(plot.options.x, axes[against()]);
    plot.curves = [...DATA.schemes].sort((a, b) => (a in dashes) - (b in dashes)).flatMap((name) => {
      const x = points[name].map(({ h }) => against() === "h" ? h : step[name] / h), y = points[name].map((point) => point.error[of() / 3]);
      return [{ x, y, colour: colours[name], dash: dashes[name], name: plot.width > 700 ? names[name] : names[name].split(",")[0] }, { x, y, colour: colours[name], dots: true }];
    });
    plot.draw();
    $("[data-meter]", element).textContent = "slopes: " + DATA.schemes.map((name) => `${names[name].split(",")[0]} ${Number.isFinite(slope(name)) ? slope(name).toFixed(2) : "…"}`).join(" · ");
  }
  Frames.add(element, tick);
  show();
  if (STILL.matches) while (todo.length || untimed.length) tick();
  globalThis.orders = { slope, finish: () => { while (todo.length) tick(); return Object.fromEntries(DATA.schemes.map((name) => [name, slope(name)])); } };
}
Frames.start();

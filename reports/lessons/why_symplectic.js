"use strict";
const { methods, functions, colours, names } = DATA;
const start = { p: DATA.p0, q: DATA.q0 };
const T_END = DATA.end;
const sum = (x) => x.reduce((a, b) => a + b, 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const scaled = (k, a) => a.map((x) => k * x);
const O = new Float64Array(1);
const H = (x) => { functions.H(x, DATA.problem, O); return O[0]; };
const lam = (x) => { functions.lam(x, DATA.problem, O); return O[0]; };

/** A momentum along the sphere, horizontal, as large as that of the first start. */
function sideways(q) {
  const w = cross([0, 0, 1], q), size = Math.hypot(...w);
  return size > 1e-3 ? scaled(DATA.speed / size, w) : [DATA.speed, 0, 0];
}

/** Two tangent vectors of the manifold with dq ^ dp = 1, momenta first; q need not be of length 1. */
function sides({ p, q }) {
  const k = q.map(Math.abs).indexOf(Math.min(...q.map(Math.abs))), n = dot(q, q);
  let u = [0, 0, 0].map((_, i) => Number(i === k) - q[k] * q[i] / n);
  u = scaled(1 / Math.hypot(...u), u);
  return [[...scaled(-dot(p, u) / n, q), ...u], [...u, 0, 0, 0]];
}
const areas = (run) => [0, 1, 2].map((i) => run.tangent(3 + i, 0) * run.tangent(i, 1) - run.tangent(i, 0) * run.tangent(3 + i, 1));

/* the bead on the torus */
{
  const element = $("#fair"), view = new View(0.6, 0.55), { names: titles, beads, h, end: last, radius, tube } = DATA.torus, all = Object.keys(titles);
  const around = (f) => Array.from({ length: 49 }, (_, k) => f(k * Math.PI / 24));
  const place = (a, b) => [(radius + tube * Math.cos(a)) * Math.cos(b), (radius + tube * Math.cos(a)) * Math.sin(b), tube * Math.sin(a)];
  const wires = [...Array(24).keys()].map((k) => around((a) => place(a, k * Math.PI / 12))).concat([...Array(8).keys()].map((k) => around((b) => place(k * Math.PI / 4, b))));
  /** The torus by its circles, what moved on it, and the bead; what is behind the middle is pale. */
  class Ring extends Sphere {
    globe(pen, width, height) {
      const r = Math.min(width, height) / 2 / (1.15 * (radius + tube)), at = ([right, up]) => [width / 2 + r * right, height / 2 - r * up];
      pen.lineWidth = 1; pen.strokeStyle = colour("--rule");
      for (const circle of wires) {
        const points = circle.map((x) => view.seen(...x));
        for (let k = 1; k < points.length; k++) { pen.globalAlpha = points[k][2] > 0 ? 0.75 : 0.25; pen.beginPath(); pen.moveTo(...at(points[k - 1])); pen.lineTo(...at(points[k])); pen.stroke(); }
      }
      const { points, count } = this.trails[0];
      pen.fillStyle = this.colour;
      for (let k = 0; k < count; k++) {
        const here = view.seen(...points.subarray(3 * k, 3 * k + 3));
        pen.globalAlpha = (here[2] > 0 ? 0.9 : 0.35) * (0.25 + 0.75 * k / count); pen.beginPath(); pen.arc(...at(here), 1.7, 0, 7); pen.fill();
      }
      pen.globalAlpha = 1;
      if (!this.bob.every(Number.isFinite)) return;
      pen.strokeStyle = colour("--paper"); pen.lineWidth = 2; pen.beginPath(); pen.arc(...at(view.seen(...this.bob)), 7, 0, 7); pen.fill(); pen.stroke();
    }
  }
  const plot = new Plot($("[data-energy]", element), {
    x: { lo: 0.1, hi: last, log: true, label: "t [s]" }, y: { lo: 1e-9, hi: 1e2, log: true, label: "largest |H − H₀| so far [J]" } });
  const dashes = { "canonical:gauss2": [9, 3], "local:gauss2": [3, 3], rk4: [2, 4] }, items = {}, row = new Float64Array(6 * 64);
  for (const name of all) items[name] = { run: new Run(methods[`torus ${name}`]) };
  for (const name of beads) {
    const globe = new Ring($(`[data-bead="${name}"]`, element), view, { rod: false });
    globe.colour = colours[name]; globe.trails = [new Trail(500, colours[name])];
    Object.assign(items[name], { globe, off: $(`[data-off="${name}"]`, element) });
  }
  let time, window_, wanted;
  function again() {
    time = 0; window_ = h; wanted = 0; plot.marks = [];
    for (const name of all) {
      const item = items[name];
      item.run.begin(item.run.method.state, h); item.peak = 0;
      item.curve = { x: [], y: [], colour: colours[name], name: titles[name], dash: dashes[name] || [], width: name === "rk4" ? 1.2 : 2 };
      item.globe?.trails[0].clear();
    }
    show();
  }
  function advance(n) {
    for (const name of all) {
      const { run, curve, globe } = items[name];
      if (run.status) continue;
      run.advance(n, globe ? Math.max(1, Math.ceil(n / 40)) : 0, row);
      for (let k = 0; globe && k < run.rows; k++) globe.trails[0].add(row[6 * k + 3], row[6 * k + 4], row[6 * k + 5]);
      items[name].peak = Math.max(items[name].peak, run.worst());
      if (run.status) {
        curve.x.push(run.t); curve.y.push(1e300);
        plot.marks.push({ x: run.t, colour: colours[name], row: plot.marks.length, text: `${titles[name].split(",")[0]}: overflow at t = ${shown(run.t, 3)} s` });
      }
    }
    time += n * h;
    if (time < window_ - h / 2) return;
    for (const { run, curve, peak } of Object.values(items)) if (!run.status && peak > 0) { curve.x.push(time); curve.y.push(peak); }
    window_ = time * 1.05;
  }
  function tick(dt) {
    if (time >= last - h / 2) return;
    wanted += dt * Math.max(4, 0.4 * time) / h;
    const n = Math.min(Math.floor(wanted), 4000, Math.round((last - time) / h));
    if (n < 1) return;
    wanted = Math.min(wanted - n, 1);
    for (let left = n; left > 0;) {
      const part = Math.min(left, Math.max(1, Math.ceil((window_ - time) / h)));
      advance(part); left -= part;
    }
    show();
  }
  function show() {
    plot.curves = all.map((name) => items[name].curve);
    for (const name of beads) {
      const { run, globe, off } = items[name], q = [3, 4, 5].map((i) => run.value(i));
      globe.bob = q; off.textContent = `${shown(Math.abs(Math.hypot(Math.hypot(q[0], q[1]) - radius, q[2]) - tube), 2)} m`;
      globe.draw();
    }
    plot.draw();
    $("[data-meter]", element).textContent = `t = ${shown(time, 4)} s of ${shown(last, 1)} s, h = ${h} s`;
  }
  $("[data-again]", element).addEventListener("click", again);
  again();
  Frames.add(element, tick);
  if (STILL.matches) while (time < last - h / 2) tick(0.1);
  globalThis.fair = { items, tick, again, get time() { return time; } };
}

/* the pendulum, as a bob that one can drag */
{
  const element = $("#three"), view = new View(), globes = ["rattle", "midpoint", "se"], heroes = [...globes, "rk4"], runs = {};
  const plot = new Plot($("[data-energy]", element), {
    x: { lo: 0.1, hi: T_END, log: true, label: "t [s]" }, y: { lo: 1e-10, hi: 1e2, log: true, label: "largest |H − H₀| since the last point [J]" } });
  for (const name of heroes) {
    runs[name] = { run: new Run(methods[name]), trail: new Trail(160, colours[name]), curve: { x: [], y: [], colour: colours[name], name: names[name], dash: name === "rk4" ? [2, 4] : name === "midpoint" ? [7, 3] : [], width: name === "rk4" ? 1.2 : 2 } };
    if (!globes.includes(name)) continue;
    const globe = new Sphere($(`[data-globe="${name}"]`, element), view, { onStart: (q) => { start.q = q; start.p = sideways(q); again(); } });
    globe.colour = colours[name]; globe.trails = [runs[name].trail];
    Object.assign(runs[name], { globe, rod: $(`[data-rod="${name}"]`, element) });
  }
  let time, window_, wanted, steps, took;
  const h = control(element, "h", () => again(), (k) => `${k / 100} s`);
  const speed = control(element, "speed", () => {}, (k) => k ? `${counted(10 ** (k / 10), "step")} a frame` : "faster and faster");
  function again() {
    time = 0; window_ = 0.1; wanted = 0;
    for (const name of heroes) {
      const item = runs[name];
      item.run.begin([...start.p, ...start.q], h() / 100);
      item.trail.clear(); item.curve.x = []; item.curve.y = []; item.peak = 0;
    }
    plot.marks = [];
    show();
  }
  const row = new Float64Array(6 * 64);
  /** Take n steps with all, with at most 40 points of the path for the trail. */
  function advance(n) {
    const before = performance.now();
    for (const name of heroes) {
      const { run, trail, curve } = runs[name];
      if (run.status) continue;
      const every = Math.max(1, Math.ceil(n / 40));
      run.advance(n, every, row);
      for (let k = 0; k < run.rows; k++) trail.add(row[6 * k + 3], row[6 * k + 4], row[6 * k + 5]);
      runs[name].peak = Math.max(runs[name].peak, run.worst());
      if (run.status) {
        curve.x.push(run.t); curve.y.push(1e300);
        plot.marks.push({ x: run.t, colour: colours[name], row: plot.marks.length, text: `${names[name]} ends at t = ${shown(run.t, 4)} s: ${run.status === 1 ? "no solution of its step" : "overflow"}` });
      }
    }
    time += n * h() / 100; steps = n; took = performance.now() - before;
    if (time >= window_) {
      for (const name of heroes) {
        const { run, curve, peak } = runs[name];
        if (!run.status && peak > 0) { curve.x.push(time); curve.y.push(peak); }
        runs[name].peak = 0;
      }
      window_ = time * 1.06;
    }
  }
  function tick(dt) {
    if (time >= T_END) return;
    wanted += speed() ? 10 ** (speed() / 10) : dt * Math.max(1.5, 0.4 * time) / (h() / 100);
    const n = Math.min(Math.floor(wanted), 1e4, Math.ceil((T_END - time) / (h() / 100)));
    if (n < 1) return;
    wanted = Math.min(wanted - n, 1);
    for (let left = n; left > 0;) {
      const part = Math.min(left, Math.max(1, Math.round(Math.max(window_ - time, 0) / (h() / 100)) || 1));
      advance(part); left -= part;
    }
    steps = n;
    show();
  }
  function show() {
    plot.curves = heroes.map((name) => runs[name].curve);
    for (const name of globes) {
      const { run, globe, rod } = runs[name], q = [3, 4, 5].map((i) => run.value(i));
      globe.bob = q; rod.textContent = run.status ? `gone at t = ${shown(run.t, 4)} s` : `${shown(Math.hypot(...q), 4)} m`;
      globe.draw();
    }
    plot.draw();
    $("[data-meter]", element).textContent = `t = ${shown(time, 4)} s · ${counted(Frames.rate, "frame")} a second · ${counted(steps || 0, "step")} a frame with each method`;
  }
  $("[data-again]", element).addEventListener("click", again);
  again();
  Frames.add(element, tick);
  if (STILL.matches) { while (time < T_END) tick(0.1); }
  globalThis.hero = { runs, tick, again, get time() { return time; } };
}

/* the reduced equations, almost exactly */
{
  const element = $("#index"), view = new View(), run = new Run(methods.rk4), globe = new Sphere($("[data-globe]", element), view);
  globe.colour = colours.rk4; globe.room = 1.45;
  const trail = new Trail(400, colours.rk4);
  globe.trails = [trail];
  const rod = control(element, "rod", () => again(), (k) => shown(1 + k / 100, 3));
  const rows = new Float64Array(6 * 40);
  function again() {
    const length = 1 + rod() / 100;
    trail.clear(); run.begin([...DATA.p0, ...scaled(length, DATA.q0)], 0.002); show();
  }
  function show() {
    globe.bob = [3, 4, 5].map((i) => run.value(i));
    $("[data-rod]", element).textContent = shown(Math.hypot(...globe.bob), 6);
    globe.draw();
  }
  function tick(dt) {
    const n = Math.round(1.5 * dt / 0.002);
    run.advance(n, Math.max(1, n >> 1), rows);
    for (let k = 0; k < run.rows; k++) trail.add(rows[6 * k + 3], rows[6 * k + 4], rows[6 * k + 5]);
    show();
  }
  again();
  Frames.add(element, tick);
  if (STILL.matches) for (let k = 0; k < 60; k++) tick(0.05);
}

/* the parallelogram */
{
  const element = $("#area"), carried = DATA.carried, runs = {};
  const plot = new Plot($("[data-area]", element), { x: { lo: 0, hi: 20, label: "t [s]" }, y: { lo: 1e-17, hi: 1e1, log: true, label: "change of the area |dq ∧ dp − 1|" }, rows: true });
  const now = control(element, "method", () => show()), h = control(element, "h", () => again(), (k) => `${k / 100} s`);
  const planes = $$("[data-plane]", element).map((canvas, i) => new Picture(canvas, (pen, width, height) => shadow(pen, width, height, i)));
  let first;
  function again() {
    first = sides(start);
    for (const name of carried) {
      const run = new Run(methods[`${name} tangents`]).begin([...start.p, ...start.q], h() / 100, first);
      runs[name] = { run, curve: { x: [], y: [], colour: colours[name] }, area: 1 };
    }
    plot.options.x.hi = 20;
    show();
  }
  function tick(dt) {
    const h_ = h() / 100;
    tick.wanted = Math.min((tick.wanted || 0) + 1.5 * dt, 0.5);
    while (tick.wanted >= h_) {
      tick.wanted -= h_;
      for (const name of carried) {
        const item = runs[name];
        if (item.run.status) continue;
        item.run.advance(1);
        item.area = sum(areas(item.run));
        item.curve.x.push(item.run.t); item.curve.y.push(Math.max(Math.abs(item.area - 1), 1e-17));
        if (item.curve.x.length > 4000) { item.curve.x.splice(0, 1000); item.curve.y.splice(0, 1000); }
        if (item.run.t > plot.options.x.hi) plot.options.x.hi *= 1.5;
      }
    }
    show();
  }
  function shadow(pen, width, height, i) {
    const run = runs[now()].run, r = 0.42 * Math.min(width, height);
    const v = [0, 1].map((k) => [run.tangent(3 + i, k), run.tangent(i, k)]), w = [0, 1].map((k) => [first[k][3 + i], first[k][i]]);
    const size = Math.max(...[0, 1, 2].flatMap((j) => [0, 1].map((k) => Math.hypot(run.tangent(3 + j, k), run.tangent(j, k)))), 1) * 1.5;
    line(pen, [[width / 2 - r, height / 2], [width / 2 + r, height / 2]], colour("--rule"));
    line(pen, [[width / 2, height / 2 - r], [width / 2, height / 2 + r]], colour("--rule"));
    for (const [[a, b], ink, fill] of [[w, colour("--quiet"), 0.15], [v, colours[now()], 0.45]]) {
      const at = (x, y) => [width / 2 + r * x / size, height / 2 - r * y / size];
      pen.beginPath(); pen.moveTo(...at(0, 0)); pen.lineTo(...at(...a)); pen.lineTo(...at(a[0] + b[0], a[1] + b[1])); pen.lineTo(...at(...b)); pen.closePath();
      pen.fillStyle = pen.strokeStyle = ink; pen.lineWidth = 1.5; pen.globalAlpha = fill; pen.fill(); pen.globalAlpha = 1; pen.stroke();
    }
  }
  function show() {
    const parts = areas(runs[now()].run);
    $$("[data-shadow]", element).forEach((output, i) => { output.textContent = shown(parts[i], 3); });
    $("[data-sum]", element).textContent = runs[now()].area.toFixed(12);
    plot.curves = carried.map((name) => ({ ...runs[name].curve, name: plot.width > 700 ? names[name] : name === now() ? names[name] : "", width: name === now() ? 3 : 1.3, dash: name === "se+proj" ? [7, 3] : [] }));
    planes.forEach((plane) => plane.draw());
    plot.draw();
  }
  $("[data-again]", element).addEventListener("click", again);
  again();
  Frames.add(element, tick);
  if (STILL.matches) for (let k = 0; k < 60; k++) tick(0.2);
  globalThis.area = { runs, tick };
}

/* the formula */
{
  const element = $("#why"), h = 0.001, run = new Run(methods["rk4 tangents"]);
  const plot = new Plot($("[data-change]", element), { x: { lo: 0, hi: 10, label: "t [s]" }, y: { lo: -1, hi: 1, label: "change of the area" } });
  const rod = control(element, "rod", () => again(), (k) => shown(1 + k / 100, 3));
  let line_, dots, integral, rate, worst;
  const x = new Float64Array(6), moved = new Float64Array(6);
  /** -dg ^ dlam of the two sides of the parallelogram; slopes of lambda by a central difference. */
  function leak() {
    run.state(x);
    const [dg, dlam] = [[], []];
    for (const k of [0, 1]) {
      const size = 1e-6, ends = [1, -1].map((sign) => { for (let i = 0; i < 6; i++) moved[i] = x[i] + sign * size * run.tangent(i, k); return lam(moved); });
      dlam.push((ends[0] - ends[1]) / (2 * size));
      dg.push(2 * (x[3] * run.tangent(3, k) + x[4] * run.tangent(4, k) + x[5] * run.tangent(5, k)));
    }
    return -(dg[0] * dlam[1] - dg[1] * dlam[0]);
  }
  /** Tangent vectors of the sphere of radius 1, pushed off it as the start is: there they have dg, as vectors that errors have moved do. */
  function again() {
    run.begin([...DATA.p0, ...scaled(1 + rod() / 100, DATA.q0)], h, sides({ p: DATA.p0, q: DATA.q0 }).map((v, k) => k ? v : v.map((y, i) => y + (i > 2 ? rod() / 100 * DATA.q0[i - 3] : 0))));
    const area0 = sum(areas(run));
    line_ = { x: [0], y: [0], colour: colours.rk4, width: 2.5, name: "as carried" }; dots = { x: [], y: [], colour: colour("--ink"), dots: true, name: "by the formula" };
    integral = 0; rate = leak(); worst = 0; again.area = area0;
    tick(0);
  }
  function tick(dt) {
    for (let k = 0; k < Math.round(dt * 1500) && run.t < 10; k++) {
      run.advance(1);
      const next = leak();
      integral += h * (rate + next) / 2; rate = next;
      if (run.steps % 20 === 0) { line_.x.push(run.t); line_.y.push(sum(areas(run)) - again.area); }
      if (run.steps % 400 === 0) { dots.x.push(run.t); dots.y.push(integral); }
      worst = Math.max(worst, Math.abs(sum(areas(run)) - again.area - integral));
    }
    const size = Math.max(1e-9, ...line_.y.map(Math.abs)) * 1.15;
    Object.assign(plot.options.y, rod() ? { lo: -size, hi: size } : { lo: -1, hi: 1 });
    plot.curves = [line_, dots];
    plot.draw();
    $("[data-meter]", element).textContent = `t = ${shown(run.t, 3)} s · area changed by ${shown(sum(areas(run)) - again.area, 3)} · formula and area differ by ${shown(worst, 2)} at most`;
  }
  again();
  Frames.add(element, tick);
  if (STILL.matches) tick(7);
  globalThis.formula = { run, tick, again, get worst() { return worst; }, get change() { return sum(areas(run)) - again.area; } };
}

/* what each method keeps */
{
  const element = $("#care"), body = $("[data-verdicts]", element), h = 0.05;
  const list = DATA.carried.map((name) => ({ name, run: new Run(methods[name]).begin([...DATA.p0, ...DATA.q0], h), tangent: new Run(methods[`${name} tangents`]).begin([...DATA.p0, ...DATA.q0], h, sides({ p: DATA.p0, q: DATA.q0 })), rod: 0, area: 0, early: 0, all: 0 }));
  const rows = new Float64Array(6 * 100), ended = (run) => `ends at t = ${shown(run.t, 3)} s`;
  function tick() {
    for (const item of list) {
      if (item.run.t < 1000 - h / 2) {
        item.run.advance(100, 1, rows);
        for (let k = 0; k < item.run.rows; k++) item.rod = Math.max(item.rod, Math.abs(Math.hypot(rows[6 * k + 3], rows[6 * k + 4], rows[6 * k + 5]) - 1));
        item.all = Math.max(item.all, item.run.worst());
        if (item.run.t < 100 + h / 2) item.early = item.all;
      }
      if (item.tangent.t < 20 - h / 2) { item.tangent.advance(10); item.area = Math.max(item.area, Math.abs(sum(areas(item.tangent)) - 1)); }
    }
    body.innerHTML = list.map(({ name, run, rod, area, early, all }) => `<tr><td><span class="swatch" style="background:${colours[name]}"></span>${names[name]}</td><td>${shown(rod, 2)} m</td><td>${shown(area, 2)}</td><td>${run.status && run.t < 100 ? ended(run) : `${shown(early, 2)} J`}</td><td>${run.status ? ended(run) : run.t > 101 ? `${shown(all, 2)} J` : "…"}</td></tr>`).join("");
    const run = list[0].run;
    $("[data-meter]", element).textContent = `computed here and now: t = ${shown(run.t, 4)} s of 1000 s, h = ${h} s; the area up to t = 20 s`;
    if (run.t > 1000 - h / 2) screen.play(false);
  }
  const screen = Frames.add(element, tick);
  tick();
  if (STILL.matches) for (let k = 0; k < 200; k++) tick();
  globalThis.verdicts = list;
}
/* the numbers of the sentences, of the first start and h = 0.05 s */
{
  const h = 0.05, fill = (name, text) => $$(`[data-fill="${name}"]`).forEach((output) => { output.textContent = text; });
  const [rattle, midpoint, se, rk4] = ["rattle", "midpoint", "se", "rk4"].map((name) => { const run = new Run(methods[name]).begin([...DATA.p0, ...DATA.q0], h); run.advance(Math.round(T_END / h)); return run; });
  const carried = new Run(methods["se tangents"]).begin([...DATA.p0, ...DATA.q0], h, sides({ p: DATA.p0, q: DATA.q0 }));
  const change = (n) => { carried.advance(n); return Math.abs(sum(areas(carried)) - 1); };
  globalThis.facts = { bound: rattle.worst(), midpoint: midpoint.worst(), stopped: se.t, end: rk4.t, complete: !rattle.status && !midpoint.status, one: change(1), several: change(9) };
  for (const name of ["bound", "midpoint"]) fill(name, shown(facts[name], 2));
  fill("stopped", shown(facts.stopped, 3)); fill("end", shown(Math.round(facts.end), 4));
  fill("one", shown(facts.one, 1)); fill("several", shown(facts.several, 1));
}
Frames.start();

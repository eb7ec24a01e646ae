"use strict";
const { methods, functions, colours, names } = DATA;
const O = new Float64Array(1);
const FINE = 16;
const CAT = (() => {
  const corners = [[0.95, 0.55], [0.85, 1.25], [0.35, 0.93], [-0.35, 0.93], [-0.85, 1.25], [-0.95, 0.55]];
  for (let k = 0; k <= 24; k++) { const a = (150 + 10 * k) * Math.PI / 180; corners.push([Math.cos(a), Math.sin(a)]); }
  return corners.flatMap((a, k) => { const b = corners[(k + 1) % corners.length]; return Array.from({ length: FINE }, (_, j) => [0, 1].map((i) => a[i] + (b[i] - a[i]) * j / FINE)); });
})();
const SIZE = 0.22;

/** The Poisson volume of the parallelogram of a run with tangents. */
const volume = (run) => (run.tangent(0, 0) * run.tangent(1, 1) - run.tangent(0, 1) * run.tangent(1, 0)) / (run.value(0) * run.value(1));
/** By how much a run with tangents has changed the Poisson volume. */
const change = (run, volume0) => Math.abs(volume(run) / volume0 - 1);

/* the cat */
{
  const element = $("#cat"), items = {}, middle = [-0.45, 0.5], half = 2.4;
  let at = [Math.log(4), Math.log(2)], wanted, t;
  const plot = new Plot($("[data-volume]", element), { x: { lo: 0, hi: 20, label: "t [s]" }, y: { lo: 1e-17, hi: 1e1, log: true, label: "change of the Poisson volume" }, rows: true });
  const h = control(element, "h", () => again(), (k) => `${shown(k / 100, 2)} s`);
  for (const name of DATA.carried) {
    const canvas = $(`[data-plane="${name}"]`, element);
    const item = items[name] = { picture: new Picture(canvas, (pen, width, height) => plane(pen, width, height, item)), one: new Run(methods[`lotka_volterra ${name}`]), tangent: new Run(methods[`lotka_volterra ${name} tangents`]), colour: colours[name], output: $(`[data-cat="${name}"]`, element) };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      const move = (moved) => { const box = canvas.getBoundingClientRect(); at = [middle[0] + half * (2 * (moved.clientX - box.left) / box.width - 1), middle[1] - half * (2 * (moved.clientY - box.top) / box.height - 1)].map((x, i) => clamp(x, middle[i] - half + 0.3, middle[i] + half - 0.3)); again(); };
      move(event);
      canvas.addEventListener("pointermove", move);
      canvas.addEventListener("pointerup", () => canvas.removeEventListener("pointermove", move), { once: true });
    });
  }
  const phase = new Plot($("[data-phase]", element), { x: { lo: 0, hi: 5, label: "predators u" }, y: { lo: 0, hi: 5, label: "prey v" } });
  let orbit;
  /** The orbit through the start, by the splitting with a small step, and axes that hold it. */
  function closed() {
    const rows = new Float64Array(2 * 2000), run = new Run(methods["lotka_volterra strang"]).begin(at.map(Math.exp), 0.01);
    run.advance(2000, 1, rows);
    orbit = { x: [], y: [], colour: colour("--ink"), dash: [5, 4], width: 1.2 };
    for (let k = 0; k < run.rows; k++) { orbit.x.push(rows[2 * k]); orbit.y.push(rows[2 * k + 1]); }
    phase.options.x.hi = 1.3 * Math.max(...orbit.x); phase.options.y.hi = 1.3 * Math.max(...orbit.y);
  }
  function again() {
    wanted = 0; t = 0; plot.options.x.hi = 20; closed();
    for (const name of DATA.carried) {
      const item = items[name], y = at.map(Math.exp);
      item.points = CAT.map(([a, b]) => [at[0] + SIZE * a, at[1] + SIZE * b]);
      item.first = item.points; item.path = [at]; item.orbit = { x: [y[0]], y: [y[1]], colour: item.colour, width: 1.4 };
      item.tangent.begin(y, h() / 100, [[1, 0], [0, 1]]); item.volume = volume(item.tangent);
      item.curve = { x: [], y: [], colour: item.colour, name: plot.width > 700 ? names[name] : "" };
      item.gone = false;
    }
    show();
  }
  function step() {
    for (const name of DATA.carried) {
      const item = items[name], { one, tangent, curve } = item;
      if (tangent.status || item.gone) continue;
      tangent.advance(1);
      item.points = item.points.map((point) => { one.begin(point.map(Math.exp), h() / 100); item.gone ||= !one.advance(1); return [0, 1].map((i) => Math.log(one.value(i))); });
      if (tangent.status || item.gone) continue;
      item.path.push([0, 1].map((i) => Math.log(tangent.value(i))));
      [item.orbit.x, item.orbit.y].forEach((values, i) => { values.push(tangent.value(i)); if (values.length > 4000) values.shift(); });
      if (item.path.length > 600) item.path.shift();
      curve.x.push(tangent.t); curve.y.push(Math.max(change(tangent, item.volume), 1e-17));
      if (curve.x.length > 4000) { curve.x.splice(0, 1000); curve.y.splice(0, 1000); }
    }
    t += h() / 100;
    if (t > plot.options.x.hi) plot.options.x.hi *= 1.5;
  }
  function tick(dt) {
    wanted = Math.min(wanted + 1.5 * dt, 0.6);
    for (; wanted >= h() / 100; wanted -= h() / 100) step();
    show();
  }
  function plane(pen, width, height, item) {
    const X = (x) => width / 2 * (1 + (x - middle[0]) / half), Y = (y) => height / 2 * (1 - (y - middle[1]) / half), ink = colour("--ink");
    for (const k of [0.1, 0.3, 1, 3, 10].map(Math.log)) {
      line(pen, [[X(k), 0], [X(k), height]], colour("--hair")); line(pen, [[0, Y(k)], [width, Y(k)]], colour("--hair"));
      pen.fillStyle = colour("--quiet"); pen.fillText(shown(Math.exp(k), 1), X(k) + 2, height - 4); pen.fillText(shown(Math.exp(k), 1), 2, Y(k) - 3);
    }
    pen.fillStyle = ink; pen.textAlign = "right"; pen.fillText("predators u", width - 5, height - 18); pen.textAlign = "left"; pen.fillText("prey v", 34, 13);
    pen.lineWidth = 1; line(pen, item.path.map(([x, y]) => [X(x), Y(y)]), colour("--rule"));
    for (const [points, trace, alpha] of [[item.first, colour("--quiet"), 0.12], [item.points, item.colour, 0.4]]) {
      pen.beginPath(); points.forEach(([x, y], k) => k ? pen.lineTo(X(x), Y(y)) : pen.moveTo(X(x), Y(y))); pen.closePath();
      pen.fillStyle = pen.strokeStyle = trace; pen.lineWidth = 1.6; pen.globalAlpha = alpha; pen.fill(); pen.globalAlpha = 1; pen.stroke();
    }
  }
  function show() {
    for (const name of DATA.carried) {
      const item = items[name];
      item.output.textContent = item.gone || item.tangent.status ? `no step from t = ${shown(item.tangent.t, 3)} s` : `${(volume(item.tangent) / item.volume).toFixed(6)} of the first`;
      item.picture.draw();
    }
    plot.curves = DATA.carried.map((name) => items[name].curve); plot.draw();
    phase.curves = [...DATA.carried.map((name) => items[name].orbit), orbit]; phase.draw();
    $("[data-meter]", element).textContent = `t = ${shown(t, 3)} s · in the pictures of the cat axes are logarithmic, so that the volume is an area · volume of a small piece: by derivatives at the middle of the cat`;
  }
  again();
  Frames.add(element, tick);
  if (STILL.matches) for (let k = 0; k < 30; k++) tick(0.2);
  globalThis.cats = { items, step, get time() { return t; } };
}

/* the sentence */
{
  globalThis.facts = {};
  for (const name of DATA.carried) {
    const run = new Run(methods[`lotka_volterra ${name} tangents`]).begin([4, 2], 0.2, [[1, 0], [0, 1]]);
    run.advance(100);
    if (run.status) Object.assign(facts, { [name]: NaN, [`${name} ends`]: run.t });
    else facts[name] = change(run, 1 / 8);
    $(`[data-fill="${name}"]`).textContent = run.status ? shown(run.t, 3) : shown(facts[name], 1);
  }
}

/* the body */
{
  const element = $("#body"), view = new View(0.7, 0.4), items = {};
  let y0 = DATA.y0, wanted;
  const h = control(element, "h", () => again(), (k) => `${shown(k / 10, 2)} s`);
  const H = (run) => { functions.body.H(run.state(), DATA.body, O); return O[0]; };
  const plot = new Plot($("[data-energies]", element), { x: { lo: 0, hi: 200, label: "t [s]" }, y: { lo: 1e-20, hi: 1e1, log: true, label: "energy error [J]" }, rows: true });
  for (const name of DATA.spun) {
    const globe = new Sphere($(`[data-globe="${name}"]`, element), view, { rod: false, onStart: (y) => { y0 = y; again(); } });
    globe.colour = colours[name]; globe.room = 1.3;
    const trail = new Trail(700, colours[name], true);
    globe.trails = [trail];
    items[name] = { globe, trail, run: new Run(methods[`free_rigid_body ${name}`]) };
  }
  function again() {
    wanted = 0; plot.options.x.hi = 200;
    for (const [name, item] of Object.entries(items)) {
      item.run.begin(y0, h() / 10); item.trail.clear(); item.H0 = H(item.run);
      item.curve = { x: [], y: [], colour: colours[name] };
    }
    show();
  }
  function tick(dt) {
    wanted = Math.min(wanted + 40 * dt, 6);
    for (; wanted >= 1; wanted--) for (const { run, trail, curve, H0 } of Object.values(items)) {
      if (!run.advance(1)) continue;
      trail.add(run.value(0), run.value(1), run.value(2));
      curve.x.push(run.t); curve.y.push(Math.max(Math.abs(H(run) - H0), 1e-17));
      if (curve.x.length > 4000) for (const key of ["x", "y"]) curve[key] = curve[key].filter((_, k) => k % 2);
      if (run.t > plot.options.x.hi) plot.options.x.hi *= 1.5;
    }
    show();
  }
  function show() {
    for (const name of DATA.spun) {
      const { run, globe, H0 } = items[name], y = [0, 1, 2].map((i) => run.value(i));
      globe.bob = y; globe.draw();
      $(`[data-length="${name}"]`, element).textContent = Math.hypot(...y).toFixed(10);
      $(`[data-energy="${name}"]`, element).textContent = `${shown(H(run) - H0, 2)} J`;
    }
    plot.curves = DATA.spun.map((name) => ({ ...items[name].curve, name: plot.width > 700 ? names[name] : "" })); plot.draw();
    $("[data-meter]", element).textContent = `t = ${shown(items.rk4.run.t, 4)} s · ${items.rk4.run.steps} steps`;
  }
  again();
  Frames.add(element, tick);
  if (STILL.matches) for (let k = 0; k < 100; k++) tick(0.1);
  globalThis.body = items;
}
Frames.start();

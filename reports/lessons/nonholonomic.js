"use strict";
const { methods, functions, colours, names } = DATA;
const O = new Float64Array(1), LEAST = 1e-9;
const MIRROR = [1, 1, -1, -1, -1, 1];

/** Run a method: parameters of the transmission, the pendulum's push and a step. */
function begun(name, { asymmetry = 0, coupling = 0, push = 2.5 }, h, state = [DATA.p0[0], push, DATA.p0[2], ...DATA.q0]) {
  const run = new Run(methods[name]);
  run.P[DATA.place.asymmetry] = asymmetry; run.P[DATA.place.coupling] = coupling;
  return run.begin(state, h);
}
const energy = (run) => { functions.H(run.state(), run.P, O); return O[0]; };
const pendulum = (run) => run.value(1) ** 2 / 2 - Math.cos(run.value(4)) + run.P[DATA.place.asymmetry] * Math.sin(2 * run.value(4)) / 2;
/** The energy of both oscillators. */
const driven = (run) => energy(run) - pendulum(run);

/* the transmission */
{
  const element = $("#transmission"), items = {};
  const plot = new Plot($("[data-errors]", element), { x: { lo: 10, hi: 1000, log: true, label: "t" }, y: { lo: LEAST, hi: 10, log: true, label: "largest energy error" }, rows: true });
  const machine = new Picture($("[data-machine]", element), draw);
  const asymmetry = control(element, "asymmetry", () => again(), (k) => shown(k / 20, 2)), push = control(element, "push", () => again(), (k) => shown(k / 10, 2));
  const coupling = control(element, "coupling", () => again(), (k) => shown(k / 10, 2)), h = control(element, "h", () => again(), (k) => shown(k / 20, 2));
  $("[data-again]", element).addEventListener("click", () => again());
  function again() {
    plot.options.x.hi = 1000;
    for (const name of DATA.chosen) {
      const run = begun(name, { asymmetry: asymmetry() / 20, coupling: coupling() / 10, push: push() / 10 }, h() / 20);
      items[name] = { run, H0: energy(run), worst: LEAST, next: 10, curve: { x: [], y: [], colour: colours[name] } };
    }
    show();
  }
  function tick(dt) {
    const ahead = items.dla.run.t < 20 ? dt : Math.min(dt, 0.1) * Math.max(20, items.dla.run.t / 4);
    for (const item of Object.values(items)) {
      const end = items.dla === item ? item.run.t + ahead : items.dla.run.t;
      while (item.run.t < end && item.run.advance(1)) {
        item.worst = Math.max(item.worst, Math.abs(energy(item.run) - item.H0));
        if (item.run.t >= item.next) { item.curve.x.push(item.run.t); item.curve.y.push(item.worst); item.next = item.run.t * 1.04; }
      }
    }
    if (items.dla.run.t > plot.options.x.hi) plot.options.x.hi *= 10;
    if (items.dla.run.t > 1e5) again();
    show();
  }
  function draw(pen, width, height) {
    if (!items.dla) return;
    const [x, y, z] = [3, 4, 5].map((i) => items.dla.run.value(i)), unit = Math.min(width / 7, height / 6.4), left = width / 2 - 3 * unit;
    const at = (u, w) => [width / 2 + unit * u, height * 0.7 - unit * w], ink = colour("--ink");
    const dot = ([u, w], radius, fill) => { pen.beginPath(); pen.arc(u, w, radius, 0, 7); pen.fillStyle = fill; pen.fill(); };
    pen.lineWidth = 1.5;
    for (const [place, level, name] of [[x, 2, "x"], [z, 3.2, "z"]]) {
      const [end, base] = at(clamp(place, -2.6, 2.6), level);
      line(pen, Array.from({ length: 21 }, (_, k) => [left + (end - left) * k / 20, base + (k % 2 && k < 20 ? 5 * (-1) ** (k >> 1) : 0)]), colour("--quiet"));
      line(pen, [[left, base - 12], [left, base + 12]], ink);
      dot([end, base], 9, colours["spark_lobatto3"]);
      pen.fillStyle = ink; pen.textAlign = "center"; pen.fillText(name, end, base - 14);
    }
    const bob = at(1.3 * Math.sin(y), -1.3 * Math.cos(y));
    line(pen, [at(0, 0), bob], ink); dot(at(0, 0), 3, ink); dot(bob, 9, colours.dla);
    pen.fillStyle = ink; pen.textAlign = "left"; pen.fillText(`y, ratio ${shown(Math.sin(y), 2)}`, bob[0] + 12, bob[1] + 4);
  }
  function show() {
    plot.curves = DATA.chosen.map((name) => ({ ...items[name].curve, name: plot.width > 400 ? names[name] : names[name].split(",")[0] }));
    plot.draw(); machine.draw();
    const { run } = items.dla;
    $("[data-meter]", element).textContent = `t = ${shown(run.t, 4)} · left to the oscillators: ` + DATA.chosen.map((name) => `${shown(driven(items[name].run), 2)} (${names[name].split(",")[0]})`).join(" · ");
  }
  again();
  Frames.add(element, tick);
  if (STILL.matches) for (let k = 0; k < 120; k++) tick(0.1);
  globalThis.transmission = { items, again, tick, get time() { return items.dla.run.t; } };
}

/* the sentences */
{
  const UNEVEN = { asymmetry: 0.5 };
  /** The distance from the start after the mirror has led back. */
  function back(parameters, h = 0.02, n = 1000) {
    const start = [DATA.p0[0], 2.5, DATA.p0[2], ...DATA.q0], there = begun("spark_lobatto3", parameters, h), mirrored = (run) => [...run.state()].map((x, i) => MIRROR[i] * x);
    there.advance(n);
    const home = begun("spark_lobatto3", parameters, h, mirrored(there));
    home.advance(n);
    return Math.hypot(...mirrored(home).map((x, i) => x - start[i]));
  }
  const after = (name, parameters, h) => { const run = begun(name, parameters, h); run.advance(Math.round(1000 / h)); return driven(run); };
  globalThis.facts = { even: back({}), uneven: back(UNEVEN), left: after("dla", UNEVEN, 0.2), half: after("dla", UNEVEN, 0.1), kept: after("dla", {}, 0.2), gni: after("gni", UNEVEN, 0.2) };
  for (const [name, value] of Object.entries(facts)) $(`[data-fill="${name}"]`).textContent = shown(value, value < 0.01 ? 2 : 3);
}
Frames.start();

"use strict";
const { methods, functions, colours, names, cases, axes } = DATA;
const CARRIED = Object.keys(names), SIZE = axes.length, D = SIZE / 2, LAST = 5000, LONG = 1e4, BLOB = 96;
const O = new Float64Array(Math.max(1, DATA.m));
/** The oriented area of a run's parallelogram, and the product of the lengths of its sides. */
const area = (run) => { let sum = 0; for (let i = 0; i < D; i++) sum += run.tangent(D + i, 0) * run.tangent(i, 1) - run.tangent(i, 0) * run.tangent(D + i, 1); return sum; };
const length = (run, k) => { let sum = 0; for (let i = 0; i < SIZE; i++) sum += run.tangent(i, k) ** 2; return Math.sqrt(sum); };

{
  const element = $("#motion"), items = {}, both = D === 1 ? BLOB : 0;
  const plot = new Plot($("[data-energy]", element), { x: { lo: 1, hi: 10, log: true, label: "t" }, y: { lo: 1e-12, hi: 1e2, log: true, label: "largest |H − H₀| so far" } });
  const areas = new Plot($("[data-area]"), { x: { lo: 0, hi: 20, label: "t" }, y: { lo: 1e-17, hi: 1e1, log: true, label: "change of the area |dq ∧ dp − 1|" }, rows: true });
  const step = (k) => DATA.h * 2 ** (k / 2);
  const h = control(element, "h", () => again(), (k) => shown(step(k), 3));
  const chosen = control(element, "case", () => { from = null; again(); });
  const [across, up] = ["across", "up"].map((name) => { const value = control(element, name, () => frame()); return () => Number(value()); });
  let from = null, steps, wanted, box, path, window_;
  for (const name of CARRIED) {
    const canvas = $(`[data-plane="${name}"]`, element);
    const item = items[name] = { canvas, colour: colours[name], picture: new Picture(canvas, (pen, width, height) => plane(pen, width, height, item)) };
    if (!DATA.m) canvas.addEventListener("pointerdown", (event) => {
      const place = canvas.getBoundingClientRect(), part = [(event.clientX - place.left) / place.width, 1 - (event.clientY - place.top) / place.height];
      from = Float64Array.from(from || cases[chosen()].state);
      [across(), up()].forEach((axis, k) => { from[axis] = box[k][0] + part[k] * (box[k][1] - box[k][0]); });
      again();
    });
  }
  const begun = (name, state, h_, sides) => new Run({ ...methods[name], par: cases[chosen()].par[name] }).begin(state, h_, sides);
  /** The path with small steps, and the box of the plane that holds it. */
  function frame() {
    box = [across(), up()].map((axis) => {
      const values = Array.from({ length: path.rows }, (_, k) => path.at(k, axis)), lo = Math.min(...values), hi = Math.max(...values);
      const room = 0.25 * (hi - lo) || 0.5;
      return [lo - room, hi + room];
    });
    show();
  }
  function again() {
    const { state, sides, problem } = cases[chosen()], start = from || state, h_ = step(h());
    const small = begun("rattle", start, DATA.h / 16, sides), rows = new Float64Array(SIZE * 2000);
    small.advance(8000, 4, rows);
    path = { rows: Math.max(1, small.rows), at: (k, axis) => small.rows ? rows[SIZE * k + axis] : start[axis] };
    steps = 0; wanted = 1; window_ = 1; plot.marks = [];
    Object.assign(plot.options.x, { lo: h_, hi: LAST * h_ }); areas.options.x.hi = 100 * h_;
    for (const name of CARRIED) {
      const item = items[name], line = { x: [], y: [], colour: item.colour, name: names[name], dash: name === "rk4" ? [2, 4] : [] };
      Object.assign(item, { run: begun(name, start, h_, sides), path: [Float64Array.from(start)], peak: 0, halves: [], area: 1, change: 0, off: 0, curve: line, areas: { ...line, x: [], y: [] } });
      item.problem = Float64Array.from(problem);
      item.measured = true;
    }
    frame();
    const size = (k) => (box[k][1] - box[k][0]) / 20;
    for (const name of CARRIED) items[name].blob = Array.from({ length: both }, (_, k) => { const x = Float64Array.from(start); x[1] += size(0) * Math.cos(2 * Math.PI * k / both); x[0] += size(1) * Math.sin(2 * Math.PI * k / both); return { run: begun(name, x, h_, sides), x }; });
    show();
  }
  function one(name) {
    const item = items[name], { run } = item;
    if (run.status || !run.advance(1)) {
      if (!item.ended) { item.ended = true; plot.marks.push({ x: run.t, colour: item.colour, row: plot.marks.length, text: `${names[name]} ends at t = ${shown(run.t, 3)}: ${run.status === 1 ? "no solution of its step" : "overflow"}` }); }
      return;
    }
    item.peak = Math.max(item.peak, run.worst());
    item.path.push(run.state()); if (item.path.length > 800) item.path.shift();
    for (const point of item.blob) { point.run.advance(1); point.x = point.run.state(point.x); }
    if (DATA.m) { functions.g(run.state(), item.problem, O); item.off = Math.max(item.off, ...O.map(Math.abs)); }
    item.measured &&= length(run, 0) * length(run, 1) < LONG ** 2;
    if (!item.measured) return;
    item.area = area(run); item.change = Math.max(item.change, Math.abs(item.area - 1));
    item.areas.x.push(run.t); item.areas.y.push(Math.max(Math.abs(item.area - 1), 1e-17));
    if (item.areas.x.length > 4000) for (const key of ["x", "y"]) item.areas[key] = item.areas[key].filter((_, k) => k % 2);
    if (run.t > areas.options.x.hi) areas.options.x.hi *= 1.5;
  }
  function advance() {
    for (const name of CARRIED) one(name);
    steps++;
    if (steps < window_) return;
    for (const { run, curve, peak, halves } of Object.values(items)) if (!run.status && peak > 0) { curve.x.push(run.t); curve.y.push(peak); halves.push([run.t, peak]); }
    window_ = steps * 1.04;
  }
  function tick(dt) {
    if (steps >= LAST) return;
    wanted += Math.max(1, 60 * dt * (1 + steps / 100));
    for (let n = Math.min(Math.floor(wanted), 100, LAST - steps); n > 0; n--) advance();
    wanted -= Math.floor(wanted);
    show();
  }
  function plane(pen, width, height, item) {
    if (!box) return;
    const at = (x) => [across(), up()].map((axis, k) => { const part = (x[axis] - box[k][0]) / (box[k][1] - box[k][0]); return k ? height * (1 - part) : width * part; });
    for (const k of [0, 1]) for (const [value, text] of ticks(...box[k], false, 4)) {
      const part = (value - box[k][0]) / (box[k][1] - box[k][0]), ends = k ? [[0, height * (1 - part)], [width, height * (1 - part)]] : [[width * part, 0], [width * part, height]];
      line(pen, ends, colour("--hair")); pen.fillStyle = colour("--quiet"); pen.textAlign = "left"; pen.textBaseline = "bottom";
      pen.fillText(text, k ? 2 : ends[0][0] + 2, k ? ends[0][1] - 2 : height - 2);
    }
    pen.fillStyle = colour("--ink"); pen.textAlign = "right"; pen.fillText(axes[across()], width - 4, height - 16); pen.textAlign = "left"; pen.fillText(axes[up()], 34, 15);
    pen.lineWidth = 1; line(pen, Array.from({ length: path.rows }, (_, k) => at({ [across()]: path.at(k, across()), [up()]: path.at(k, up()) })), colour("--quiet"), [5, 4]);
    pen.lineWidth = 1.6; line(pen, item.path.map(at), item.colour);
    const outline = (item.blob || []).map(({ x }) => at(x)), around = outline.reduce((sum, point, k) => sum + Math.hypot(point[0] - outline.at(k - 1)[0], point[1] - outline.at(k - 1)[1]), 0);
    // A longer outline has too few points to be drawn.
    if (around > 0 && around < 4 * width) { pen.beginPath(); outline.forEach((point, k) => k ? pen.lineTo(...point) : pen.moveTo(...point)); pen.closePath(); pen.fillStyle = item.colour; pen.globalAlpha = 0.35; pen.fill(); pen.globalAlpha = 1; }
    pen.fillStyle = item.colour; pen.strokeStyle = colour("--paper"); pen.lineWidth = 2; pen.beginPath(); pen.arc(...at(item.path.at(-1)), 6, 0, 7); pen.fill(); pen.stroke();
  }
  const most = (halves, from_, to) => Math.max(0, ...halves.filter(([t]) => t >= from_ && t <= to).map(([, peak]) => peak));
  function show() {
    const t = steps * step(h()), worst = (item, first) => shown(first ? most(item.halves, 0, t / 2) : most(item.halves, t / 2, t), 2);
    for (const name of CARRIED) {
      const item = items[name];
      if (!item.run) return;
      $(`[data-part="${name}"]`, element).textContent = item.measured ? item.area.toFixed(6) : "hidden by round-off";
      if (DATA.m) $(`[data-off="${name}"]`, element).textContent = shown(item.off, 2);
      item.picture.draw();
    }
    plot.curves = CARRIED.map((name) => items[name].curve); plot.draw();
    areas.curves = CARRIED.map((name) => items[name].areas); areas.draw();
    $("[data-verdicts]").replaceChildren(...CARRIED.map((name) => {
      const item = items[name], row = document.createElement("tr"), cells = [names[name], shown(item.change, 2), worst(item, true), item.ended ? `ended at ${shown(item.run.t, 3)}` : worst(item, false), ...DATA.m ? [shown(item.off, 2)] : []];
      cells.forEach((text) => { row.append(document.createElement("td")); row.lastChild.textContent = text; });
      return row;
    }));
    $("[data-meter]", element).textContent = `t = ${shown(t, 3)} of ${shown(LAST * step(h()), 3)} · ${counted(steps, "step")} · dashed: ${names.rattle} with h = ${shown(DATA.h / 16, 2)}`;
  }
  $("[data-again]", element).addEventListener("click", again);
  again();
  Frames.add(element, tick);
  if (STILL.matches) while (steps < LAST / 5) advance();
  show();
  globalThis.own = { items, advance, again, get steps() { return steps; }, start: (x) => { from = x; again(); } };
}
Frames.start();

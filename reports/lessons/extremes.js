"use strict";
const { methods, functions, colours, names, map: M } = DATA;
const O = new Float64Array(6), X = new Float64Array(6), LAST = new Float64Array(6);
const SIDE = M.h.length, SLICE = 8; // ms of computation in a frame
const FAR = 4; // radii of the sphere, beyond which a bob is not drawn
const per = (x, digits = 2) => `${shown(100 * x, digits)} %`;
/** A value of a function of a problem at a state. */
const value = (problem, name, x, par) => { functions[problem][name](x, par, O); return O[0]; };
/** Play a run of so many seconds in a loop, with a pause at its end; returns the time to show. */
class Clock {
  constructor(pause = 1.2) { Object.assign(this, { t: 0, pause }); }
  tick(dt, end) { this.t += dt; if (this.t > end + this.pause) { this.t = 0; return true; } return false; }
}
/** A count: 16 384. */
const count = (n) => String(n).replace(/\B(?=(\d{3})+$)/g, "\u202f");
const upto = ({ x, y, ...rest }, n) => ({ x: x.slice(0, n), y: y.slice(0, n), ...rest });

/* ---------- what becomes of a run, in the words and by the bounds of daebench/studies/grid/outcomes.py ---------- */
const mapped = Object.fromEntries(M.methods.map((name) => [name, new Run(methods[name])]));
const ROWS = new Float64Array(6 * Math.max(...M.steps));
function judged(name, row, column) {
  const run = mapped[name], h = M.h[column], n = M.steps[column], P = run.P, at = methods[name].kernel.errors;
  P[M.gravity] = M.gravities[row];
  run.begin(M.start, h).advance(n, 1, ROWS);
  const status = run.status === M.rank_lost && run.steps === n ? 0 : run.status, error = run.S[at], g = run.S[at + 1];
  const cell = { word: "", size: NaN, status, g, t: run.t, steps: run.steps, error, h, gravity: M.gravities[row] };
  if (status) { cell.word = M.statuses[status] || M.stopped; return cell; }
  let kinetic = 0, finite = 0, off = 0, fast = 0;
  for (let k = -1; k < n; k++) { // squares, whose roots are taken at the end
    for (let i = 0; i < 6; i++) X[i] = k < 0 ? M.start[i] : ROWS[6 * k + i];
    functions.pendulum.H_p(X, P, O);
    const T = (X[0] * O[0] + X[1] * O[1] + X[2] * O[2]) / 2;
    if (Number.isFinite(T)) { kinetic += T; finite++; }
    let jump = 0, speed = 0;
    for (let i = 0; i < 3; i++) {
      const part = X[3 + i] - LAST[i] - h * (LAST[3 + i] + O[i]) / 2;
      jump += part * part; speed += O[i] * O[i];
      LAST[i] = X[3 + i]; LAST[3 + i] = O[i];
    }
    if (k >= 0) off = Math.max(off, jump);
    fast = Math.max(fast, speed);
  }
  kinetic /= Math.max(finite, 1); off = Math.sqrt(off); fast = Math.sqrt(fast);
  cell.size = kinetic > 0 ? error / kinetic : error === 0 ? 0 : Infinity;
  const { off: left, other, lost, coarse, fine } = M.words;
  cell.word = !(g <= M.off) ? left : h * fast > 0 && off / (h * fast) > M.jump ? other : !(cell.size <= M.all) ? lost : cell.size > M.large ? coarse : fine;
  return cell;
}
/** The largest step with which the line of RATTLE meets the sphere at the lowest point, with the speed that a run has there. */
function edge(gravity) {
  const P = [M.mass, M.length, gravity], fall = value("pendulum", "H", M.start, P) - value("pendulum", "H", [0, 0, 0, 0, 0, -M.length], P);
  return M.length / Math.sqrt(2 * fall / M.mass);
}

/* ---------- colours and hatches ---------- */
const HATCHES = M.hatches;
const isSized = (word) => M.sized.includes(word);
const fillOf = ({ word, size }) => isSized(word) ? M.size_colours[M.sizes.filter((x) => x <= size).length] : M.colours[word];
function tile(word, ratio) {
  const [kind, ink] = HATCHES[word], canvas = document.createElement("canvas"), n = Math.round(7 * ratio), pen = canvas.getContext("2d");
  canvas.width = canvas.height = n;
  pen.strokeStyle = pen.fillStyle = ink; pen.lineWidth = ratio; pen.globalAlpha = 0.75;
  const stroke = (...ends) => { pen.beginPath(); pen.moveTo(ends[0] * n, ends[1] * n); pen.lineTo(ends[2] * n, ends[3] * n); pen.stroke(); };
  if ("/x".includes(kind)) for (const d of [-1, 0, 1]) stroke(d, 1, d + 1, 0);
  if ("\\x".includes(kind)) for (const d of [-1, 0, 1]) stroke(d, 0, d + 1, 1);
  if (kind === "|") stroke(0.5, 0, 0.5, 1);
  if (kind === "-") stroke(0, 0.5, 1, 0.5);
  if (kind === ".") { pen.globalAlpha = 1; pen.beginPath(); pen.arc(n / 2, n / 2, 1.3 * ratio, 0, 7); pen.fill(); }
  return canvas;
}
function paint(pen, cell, ratio, box) {
  pen.fillStyle = fillOf(cell); pen.fillRect(...box);
  if (HATCHES[cell.word]) { pen.fillStyle = pen.createPattern(tile(cell.word, ratio), "repeat"); pen.fillRect(...box); }
}

/** A map that grows cell by cell. */
class OutcomeMap extends Picture {
  constructor(canvas, name) {
    super(canvas, (pen, width, height) => this.all(pen, width, height));
    Object.assign(this, { name, cells: new Array(SIDE * SIDE).fill(null), sheet: document.createElement("canvas"), patterns: {} });
  }
  get box() { return { left: 30, top: 20, width: this.width - 34, height: this.height - 56 }; }
  fit() {
    const ratio = window.devicePixelRatio || 1, rect = this.canvas.getBoundingClientRect();
    Object.assign(this, { width: rect.width, height: rect.height, ratio });
    const { width, height } = this.box;
    if (width > 0) {
      this.sheet.width = Math.round(width * ratio); this.sheet.height = Math.round(height * ratio);
      this.pencil = this.sheet.getContext("2d");
      this.patterns = Object.fromEntries(Object.keys(HATCHES).map((word) => [word, this.pencil.createPattern(tile(word, ratio), "repeat")]));
      for (const stride of [8, 4, 2, 1]) this.cells.forEach((cell, k) => { if (cell && cell.stride === stride) this.block(k, cell); });
    }
    super.fit();
  }
  put(row, column, cell) { this.cells[row * SIDE + column] = cell; if (this.pencil) this.block(row * SIDE + column, cell); }
  block(k, cell) {
    const { width, height } = this.sheet, column = k % SIDE, row = (k - column) / SIDE, at = (x, size) => Math.round(x * size / SIDE);
    const x = at(column, width), y = height - at(row + cell.stride, height);
    const rect = [x, y, at(column + cell.stride, width) - x, height - at(row, height) - y];
    this.pencil.fillStyle = fillOf(cell); this.pencil.fillRect(...rect);
    if (this.patterns[cell.word]) { this.pencil.fillStyle = this.patterns[cell.word]; this.pencil.fillRect(...rect); }
  }
  /** Where a step and a gravity are, in pixels of the picture. */
  X(h) { const { left, width } = this.box; return left + width * Math.log(h / M.h[0]) / Math.log(M.h[SIDE - 1] / M.h[0]) * (1 - 1 / SIDE) + width / SIDE / 2; }
  Y(gravity) { const { top, height } = this.box, all = M.gravities; return top + height - height * Math.log(gravity / all[0]) / Math.log(all[SIDE - 1] / all[0]) * (1 - 1 / SIDE) - height / SIDE / 2; }
  all(pen) {
    const { left, top, width, height } = this.box, ink = colour("--ink");
    pen.fillStyle = colour("--tint"); pen.fillRect(left, top, width, height);
    pen.drawImage(this.sheet, left, top, width, height);
    pen.font = pen.font.replace("13px", "12px"); pen.fillStyle = ink; pen.textBaseline = "top";
    for (const h of [0.01, 0.1, 1]) { pen.textAlign = h === 1 ? "right" : h === 0.01 ? "left" : "center"; pen.fillText(String(h), clamp(this.X(h), left, left + width), top + height + 4); }
    pen.textAlign = "right"; pen.fillText("step h [s]", left + width, top + height + 19);
    pen.textBaseline = "middle";
    for (const gravity of [0.1, 1, 10, 100]) pen.fillText(String(gravity), left - 4, clamp(this.Y(gravity), top + 5, top + height - 5));
    pen.textAlign = "left"; pen.textBaseline = "bottom"; pen.fillText("gravity [m/s²]", 0, top - 4);
    if (this.name === "rattle") {
      const line_ = M.gravities.map((gravity) => [this.X(edge(gravity)), this.Y(gravity)]);
      pen.save(); pen.beginPath(); pen.rect(left, top, width, height); pen.clip();
      pen.lineWidth = 3.5; line(pen, line_, "#fff"); pen.lineWidth = 1.6; line(pen, line_, "#000", [5, 4]);
      pen.restore();
    }
    const side = [width / SIDE, height / SIDE], x = left + chosen.column * side[0], y = top + height - (chosen.row + 1) * side[1];
    for (const [grow, trace, wide] of [[3.5, "#fff", 3.5], [3.5, "#000", 1.5]]) { pen.lineWidth = wide; pen.strokeStyle = trace; pen.strokeRect(x - grow, y - grow, side[0] + 2 * grow, side[1] + 2 * grow); }
  }
  cellAt(event) {
    const rect = this.canvas.getBoundingClientRect(), { left, top, width, height } = this.box;
    const at = (x, size) => clamp(Math.floor(x / size * SIDE), 0, SIDE - 1);
    return [at(top + height - (event.clientY - rect.top), height), at(event.clientX - rect.left - left, width)];
  }
}

/** Rows, columns and methods from coarse to fine, each once. */
function* coarseToFine() {
  for (const stride of [8, 4, 2, 1]) for (let row = 0; row < SIDE; row += stride) for (let column = 0; column < SIDE; column += stride) {
    if (stride < 8 && row % (2 * stride) === 0 && column % (2 * stride) === 0) continue;
    for (const name of M.methods) yield [stride, row, column, name];
  }
}

/* ---------- the maps and the chosen run ---------- */
const chosen = { row: 0, column: 0, name: "rattle" };
{
  const element = $("#map"), maps = {}, counts = Object.fromEntries(M.methods.map((name) => [name, {}]));
  const clock = new Clock(), globe = new Sphere($("[data-globe]", element), new View(0.9, 0.25)), trail = new Trail(220, "#000");
  const energy = new Plot($("[data-energy]", element), { x: { lo: 0, hi: M.end, label: "t [s]" }, y: { lo: 1e-10, hi: 1e6, log: true, label: "|H − H₀| [J]" } });
  const legend = new Picture($("[data-legend]", element), key);
  globe.trails = [trail]; globe.room = 1.35;
  const column = control(element, "column", () => choose({ column: column() }), (k) => `${shown(M.h[k], 2)} s`);
  const row = control(element, "row", () => choose({ row: row() }), (k) => `${shown(M.gravities[k], 2)} m/s²`);
  const method = control(element, "method", () => choose({ name: method() }));
  let work = coarseToFine(), done = 0, steps = 0, took = 0, runs = {}, drawn = 0, finished = false;
  const total = M.methods.length * SIDE * SIDE;

  /** Compute cells for some milliseconds. */
  function compute(budget) {
    const began = performance.now();
    let now = began;
    while (!finished && now - began < budget) {
      const next = work.next();
      if (next.done) { finished = true; break; }
      const [stride, r, c, name] = next.value, cell = judged(name, r, c);
      cell.stride = stride;
      maps[name].put(r, c, cell);
      counts[name][cell.word] = (counts[name][cell.word] || 0) + 1;
      done++; steps += cell.steps;
      now = performance.now();
    }
    took += now - began;
    return now - began;
  }
  const edgeShare = () => {
    const cells = maps.rattle.cells.filter(Boolean);
    return cells.filter((cell) => (cell.word === M.no_solution) === (cell.h > edge(cell.gravity))).length / cells.length;
  };
  function report() {
    const rate = took > 50 ? ` · ${[done, steps].map((n) => count(Number((1000 * n / took).toPrecision(2)))).join(" runs and ")} steps a second of computation` : "";
    $("[data-meter]", element).textContent = `${count(done)} of ${count(total)} runs made${rate}`;
    $("[data-shares]", element).innerHTML = M.methods.map((name) => {
      const all = Object.values(counts[name]).reduce((a, b) => a + b, 0) || 1, share = (words) => per(words.reduce((sum, word) => sum + (counts[name][word] || 0), 0) / all);
      const { fine, coarse, lost, off, other } = M.words, ended = [fine, coarse, lost, off, other];
      return `<tr><td style="white-space:normal"><span class="swatch" style="background:${colours[name]}"></span>${names[name]}</td><td>${share([fine])}</td><td>${share([coarse])}</td><td>${share(Object.keys(counts[name]).filter((word) => !ended.includes(word)))}</td><td>${share([lost, off, other])}</td></tr>`;
    }).join("");
    $(`[data-fill="edge"]`).textContent = per(edgeShare());
    legend.draw();
  }
  /** Make the chosen runs, one with each method. */
  function choose(change = {}) {
    Object.assign(chosen, change);
    for (const [name, position] of [["column", chosen.column], ["row", chosen.row], ["method", chosen.name]]) { const input = $(`[name="${name}"]`, element); if (String(input.value) !== String(position)) { input.value = position; input.dispatchEvent(new Event("input")); return; } }
    for (const name of M.methods) {
      const cell = judged(name, chosen.row, chosen.column), run = mapped[name], P = run.P, H0 = value("pendulum", "H", M.start, P);
      const rows = Float64Array.from([...M.start, ...ROWS.subarray(0, 6 * cell.steps)]), curve = { x: [], y: [], colour: colours[name], dash: name === "se+proj" ? [7, 3] : [] };
      for (let k = Math.min(1, cell.steps); k <= cell.steps; k++) { curve.x.push(k * cell.h); curve.y.push(Math.max(Math.abs(value("pendulum", "H", rows.subarray(6 * k, 6 * k + 6), P) - H0), 1e-17)); }
      runs[name] = { cell, rows, curve };
      $(`[data-word="${name}"]`, element).textContent = brief(cell);
      $(`[data-figure="${name}"]`, element).classList.toggle("on", name === chosen.name);
    }
    const { cell } = runs[chosen.name];
    const how = cell.status ? ` It stopped at t = ${shown(cell.t, 3)} s.` : "";
    $("[data-told]", element).innerHTML = `h = ${shown(cell.h, 2)} s, gravity ${shown(cell.gravity, 2)} m/s², ${names[chosen.name]}: <b>${cell.word}</b>: ${M.about[cell.word]}.${how}`;
    $("[data-name]", element).textContent = names[chosen.name];
    clock.t = 0; trail.clear(); trail.colour = globe.colour = colours[chosen.name]; drawn = 0;
    show();
  }
  const brief = (cell) => cell.status ? `${cell.word}, t = ${shown(cell.t, 2)} s` : isSized(cell.word) ? `${cell.word}, ${per(cell.size)}` : cell.word;
  function show() {
    const { cell, rows } = runs[chosen.name], k = Math.min(Math.floor(clock.t / cell.h), cell.steps);
    const place = (n) => [...rows.subarray(6 * n + 3, 6 * n + 6)], off = Math.hypot(...place(k));
    for (; drawn <= k; drawn++) if (Math.hypot(...place(drawn)) < FAR) trail.add(...place(drawn));
    globe.bob = off < FAR ? place(k) : [NaN, NaN, NaN];
    $("[data-rod]", element).textContent = `${shown(off, 4)} m${cell.status && k === cell.steps ? `, stopped: ${cell.word}` : ""}`;
    energy.curves = M.methods.map((name) => ({ ...upto(runs[name].curve, Math.floor(clock.t / cell.h)), width: name === chosen.name ? 3 : 1.3, name: name === chosen.name ? names[name] : "" }));
    energy.marks = runs[chosen.name].cell.status && k === cell.steps ? [{ x: cell.t, colour: colours[chosen.name], text: cell.word }] : [];
    globe.draw(); energy.draw();
    for (const map of Object.values(maps)) map.draw();
  }
  function key(pen, width, height) {
    const present = new Set(Object.values(counts).flatMap((all) => Object.keys(all))), ratio = window.devicePixelRatio || 1, ink = colour("--ink");
    const entries = Object.keys(M.colours).filter((word) => present.has(word));
    pen.textBaseline = "middle"; pen.fillStyle = ink; pen.textAlign = "left";
    const step = Math.min(44, (width - 4) / M.size_colours.length);
    pen.fillText("energy error / mean kinetic energy", 2, 9);
    M.size_colours.forEach((shade, k) => { pen.fillStyle = shade; pen.fillRect(2 + k * step, 18, step, 14); pen.strokeStyle = colour("--quiet"); pen.lineWidth = 0.6; pen.strokeRect(2 + k * step, 18, step, 14); });
    pen.textAlign = "center"; pen.fillStyle = ink;
    M.sizes.forEach((size, k) => pen.fillText(size < 0.1 ? `10${raised(Math.round(Math.log10(size)))}` : String(size), 2 + (k + 1) * step, 41));
    const wide = width > 640;
    let x = wide ? step * M.size_colours.length + 34 : 2, y = wide ? 18 : 58;
    if (wide) { pen.textAlign = "left"; pen.fillText("how a run broke", x, 9); }
    pen.textAlign = "left";
    for (const word of entries) {
      const size = 30 + pen.measureText(word).width + 16;
      if (x + size > width && x > 2) { x = wide ? step * M.size_colours.length + 34 : 2; y += 22; }
      pen.save(); pen.translate(x, y); paint(pen, { word, size: NaN }, 1, [0, 0, 24, 14]); pen.strokeStyle = colour("--quiet"); pen.strokeRect(0, 0, 24, 14); pen.restore();
      pen.fillStyle = ink; pen.fillText(word, x + 30, y + 7);
      x += size;
    }
  }
  for (const name of M.methods) {
    const canvas = $(`[data-map="${name}"]`, element), pick = (event) => { const [r, c] = map.cellAt(event); choose({ row: r, column: c, name }); };
    const map = maps[name] = new OutcomeMap(canvas, name);
    canvas.addEventListener("pointerdown", pick);
    canvas.addEventListener("pointermove", (event) => { if (event.pointerType === "mouse" && event.buttons === 1) pick(event); });
    canvas.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 0], ArrowDown: [-1, 0] }[event.key];
      if (!way) return;
      event.preventDefault();
      choose({ row: clamp(chosen.row + way[0], 0, SIDE - 1), column: clamp(chosen.column + way[1], 0, SIDE - 1), name });
    });
  }
  let late = 0;
  function tick(dt) {
    if (!finished) {
      compute(SLICE);
      if (finished || (late += dt) > 0.3) { late = 0; report(); }
    }
    if (clock.tick(1.6 * dt, Math.min(M.end, runs[chosen.name].cell.t || M.end))) { trail.clear(); drawn = 0; }
    show();
  }
  choose({ row: row(), column: column(), name: method() });
  for (let k = 0; k < 4 * 64; k++) compute(0.001); // a first, coarse map
  report();
  Frames.add(element, tick);
  if (STILL.matches) { while (done < 4 * 1024) compute(50); report(); clock.t = M.end; show(); }
  globalThis.outcomes = { judged, maps, choose, compute, report, counts, get done() { return done; }, get finished() { return finished; }, get rate() { return { done, steps, took }; }, edgeShare };
}

/* ---------- the line that misses the sphere ---------- */
{
  const element = $("#solution"), run = new Run(methods.rattle), gravity = 1;
  run.P[M.gravity] = gravity;
  let touched = false, sweep = 0;
  const slider = $(`[name="h"]`, element);
  slider.addEventListener("pointerdown", () => { touched = true; });
  slider.addEventListener("keydown", () => { touched = true; });
  const largest = () => { const y = slope(), v = speed() / 10, L = M.length; return y ? Math.sqrt(2 * (Math.sqrt(v ** 4 + y * y * L * L) - v * v)) / y : L / v; };
  const h = control(element, "h", () => show(), (k) => `${shown(k / 100, 3)} of the largest`);
  const speed = control(element, "speed", () => again(), (k) => `${shown(k / 10, 2)} m/s`);
  const angle = control(element, "angle", () => again(), (k) => `${k}°`);
  const picture = new Picture($("[data-line]", element), draw);
  const slope = () => gravity * Math.sin(angle() * Math.PI / 180);
  const start = () => { const a = angle() * Math.PI / 180; return [0, M.mass * speed() / 10, 0, M.length * Math.sin(a), 0, -M.length * Math.cos(a)]; };
  const solves = (step) => run.begin(start(), step).advance(1) === 1;
  /** The largest step that the kernel solves, by bisection. */
  function bisected() {
    let lo = largest() / 4, hi = 4 * largest();
    for (let k = 0; k < 60; k++) { const middle = (lo + hi) / 2; if (solves(middle)) lo = middle; else hi = middle; }
    return lo;
  }
  /** A step in the plane of the old rod (upwards) and of the motion along the sphere (to the right). */
  function step_() {
    const x = start(), step = largest() * h() / 100, q = x.slice(3), P = run.P;
    functions.pendulum.H_q(x, P, O);
    const half = x.slice(0, 3).map((p, i) => p - step / 2 * O[i]);
    functions.pendulum.H_p([...half, ...q], P, O);
    const a = q.map((y, i) => y + step * O[i]), up = q.map((y) => y / M.length), rise = a.reduce((sum, y, i) => sum + y * up[i], 0);
    const flat = a.map((y, i) => y - rise * up[i]), across = Math.hypot(...flat), unit = flat.map((y) => y / across);
    const place = (y) => [y.reduce((sum, z, i) => sum + z * unit[i], 0), y.reduce((sum, z, i) => sum + z * up[i], 0)];
    const solved = solves(step), end = run.state(), moved = solved ? [...end.slice(3)] : null;
    return { step, a, q, free: [across, rise], across, solved, end: moved ? place(moved) : null, q1: moved, beside: moved ? Math.hypot(...moved.map((y, i) => y - a[i] - (moved.reduce((s, z, j) => s + (z - a[j]) * up[j], 0)) * up[i])) : NaN };
  }
  function again() {
    const formula = largest(), measured = bisected();
    $("[data-formula]", element).textContent = `${shown(formula, 7)} s`;
    $("[data-measured]", element).textContent = `${shown(measured, 7)} s`;
    facts_.formula = formula; facts_.measured = measured;
    h(); show();
  }
  const facts_ = globalThis.line_ = { step: step_, again, largest, bisected };
  function draw(pen, width, height) {
    const now = step_(), r = Math.min(width / 3.6, height / 2.55), at = ([x, y]) => [width * 0.42 + r * x / M.length, height * 0.52 - r * y / M.length];
    const ink = colour("--ink"), quiet = colour("--quiet"), hit = now.solved ? colours.rattle : colours.rk4;
    pen.lineWidth = 1.6; pen.strokeStyle = quiet; pen.beginPath(); pen.arc(...at([0, 0]), r, 0, 7); pen.stroke();
    pen.lineWidth = 1; line(pen, [at([0, 0]), at([now.across, 0])], quiet, [2, 3]);
    pen.lineWidth = 2; line(pen, [at([now.across, -1.22]), at([now.across, Math.max(1.18, now.free[1])])], hit);
    pen.lineWidth = 2; line(pen, [at([0, 0]), at([0, M.length])], ink);
    line(pen, [at([0, M.length]), at(now.free)], ink, [5, 4]);
    if (now.end) { pen.lineWidth = 2; line(pen, [at([0, 0]), at(now.end)], colours.rattle); }
    const dot = (place, fill, text, left = false, low = 0) => { const [x, y] = at(place); pen.fillStyle = fill; pen.beginPath(); pen.arc(x, y, 6, 0, 7); pen.fill(); pen.fillStyle = ink; pen.textAlign = left ? "right" : "left"; pen.textBaseline = "middle"; pen.fillText(text, x + (left ? -10 : 10), y + low); };
    dot([0, M.length], ink, "q₀", true);
    dot(now.free, quiet, "a");
    if (now.across <= M.length) {
      const y = Math.sqrt(M.length ** 2 - now.across ** 2), other = now.end && now.end[1] < 0 ? y : -y;
      dot([now.across, other], colour("--rule"), "the other solution", false, 12);
    }
    if (now.end) dot(now.end, colours.rattle, "q₁ of RATTLE", false, 4);
    pen.fillStyle = quiet; pen.textAlign = "right"; pen.textBaseline = "middle"; pen.fillText("distance of the line", ...at([-0.05 * M.length, 0]));
    if (!now.solved) { pen.fillStyle = hit; pen.textAlign = "right"; pen.textBaseline = "bottom"; pen.font = `bold ${pen.font}`; pen.fillText("no solution", width - 4, height - 6); }
  }
  function show() {
    picture.draw();
    const now = step_();
    $("[data-meter]", element).textContent = `h = ${shown(now.step, 4)} s: the distance of the line is ${shown(now.across / M.length, 4)} of the radius, ${now.solved ? "and the kernel finds a solution" : "and the kernel finds no solution"}`;
  }
  again();
  const screen = Frames.add(element, (dt) => {
    if (touched) { touched = false; screen.play(false); return; }
    sweep += dt;
    const k = Math.round(75 - 65 * Math.cos(sweep * 0.8));
    if (k !== h()) { slider.value = k; slider.dispatchEvent(new Event("input")); }
  });
}

/* ---------- chaos ---------- */
{
  const element = $("#chaos"), C = DATA.chaos, H_ = C.h;
  const span = { lo: 0, hi: C.end, label: "t [s]" };
  const distance = new Plot($("[data-distance]", element), { x: span, y: { lo: 1e-16, hi: 1e1, log: true, label: "distance of the lower points [m]" } });
  const energy = new Plot($("[data-energy]", element), { x: span, y: { lo: 1e-10, hi: 1e2, log: true, label: "|H − H₀| [J]" } });
  const arms = new Picture($("[data-arms]", element), draw);
  const delta = control(element, "delta", () => again(), (k) => `10${raised(-k)} rad`), h = control(element, "h", () => again(), (k) => `${H_[k]} s`);
  const method = control(element, "method", () => again());
  /** Two runs, and what is drawn of them, sampled two thousand times. */
  class Pair {
    constructor(name, difference, step) {
      this.runs = [0, difference].map((angle) => { const c = Math.cos(angle), s = Math.sin(angle); return new Run(methods[`arms ${name}`]).begin([0, 0, 0, 0, c, -s, 2 * c, -2 * s], step); });
      Object.assign(this, { x: [], gap: [], errors: [[], []], every: Math.max(1, Math.round(C.end / step / 2000)), parted: NaN, worst: 0, trails: [[], []] });
      this.H0 = this.runs.map((run) => value("arms", "H", run.state(), run.P));
      this.note();
    }
    get t() { return this.runs[0].t; }
    note() {
      const [one, other] = this.runs, gap = Math.hypot(one.value(6) - other.value(6), one.value(7) - other.value(7));
      this.x.push(this.t); this.gap.push(Math.max(gap, 1e-17));
      if (!(this.parted <= this.t) && gap > C.parted) this.parted = this.t;
      this.runs.forEach((run, k) => {
        const error = Math.abs(value("arms", "H", run.state(), run.P) - this.H0[k]);
        this.worst = Math.max(this.worst, error); this.errors[k].push(Math.max(error, 1e-17));
        this.trails[k].push([run.value(6), run.value(7)]);
        if (this.trails[k].length > 60) this.trails[k].shift();
      });
    }
    /** Go on up to a time. */
    to(t) {
      while (this.t < Math.min(t, C.end) - 1e-9 && this.runs.every((run) => !run.status)) { this.runs.forEach((run) => run.advance(this.every)); this.note(); }
      return this;
    }
  }
  let pair, wanted = 0;
  function again() { pair = new Pair(method(), 10 ** -delta(), H_[h()]); wanted = 0; if (STILL.matches) pair.to(C.end); show(); }
  const INK = () => [colour("--ink"), colours.rk4];
  function show() {
    const inks = INK();
    distance.curves = [{ x: pair.x, y: pair.gap, colour: colours[method()] }];
    distance.marks = pair.parted <= C.end ? [{ x: pair.parted, colour: colour("--ink"), text: `a tenth of an arm, t = ${shown(pair.parted, 3)} s` }] : [];
    energy.curves = pair.errors.map((y, k) => ({ x: pair.x, y, colour: inks[k], width: 1.5, name: ["one", "the other"][k] }));
    [distance, energy, arms].forEach((picture) => picture.draw());
    $("[data-meter]", element).textContent = `t = ${shown(pair.t, 3)} s · distance ${shown(pair.gap.at(-1), 2)} m · energy error of both at most ${shown(pair.worst, 2)} J`;
  }
  function draw(pen, width, height) {
    const r = Math.min(width, height) / 4.3, at = ([x, y]) => [width / 2 + r * x, height / 2 - r * y];
    [1, 0].forEach((k) => {
      const run = pair.runs[k], ink = INK()[k], one = [run.value(4), run.value(5)], two = [run.value(6), run.value(7)];
      pen.lineWidth = 1.4; pen.globalAlpha = 0.5; line(pen, pair.trails[k].map(at), ink);
      pen.globalAlpha = 1; pen.lineWidth = 2.5; line(pen, [at([0, 0]), at(one), at(two)], ink, k ? [6, 3] : []);
      for (const place of [one, two]) { pen.fillStyle = ink; pen.beginPath(); pen.arc(...at(place), k ? 8 : 6, 0, 7); pen.fill(); }
    });
    pen.fillStyle = colour("--quiet"); pen.beginPath(); pen.arc(...at([0, 0]), 4, 0, 7); pen.fill();
  }
  $("[data-again]", element).addEventListener("click", again);
  again();
  Frames.add(element, (dt) => { if (pair.t >= C.end - 1e-9) return; wanted = Math.min(wanted + 1.5 * dt, C.end); pair.to(wanted); show(); });
  const whole = (name, difference) => new Pair(name, difference, C.step).to(C.end), rattle = whole("rattle", 10 ** -C.delta), fill = (name, text) => { $(`[data-fill="${name}"]`).textContent = text; };
  globalThis.chaos = { rattle: rattle.parted, lobatto3: whole("lobatto3", 10 ** -C.delta).parted, later: whole("rattle", 10 ** -C.delta / 100).parted - rattle.parted, energy: rattle.worst, gap: rattle.gap.at(-1) };
  fill("rattle", shown(chaos.rattle, 3)); fill("lobatto3", shown(chaos.lobatto3, 3)); fill("later", shown(chaos.later, 2)); fill("energy", shown(chaos.energy, 2));
}

/* ---------- lock-up ---------- */
{
  const element = $("#lock"), L = DATA.lock, clock = new Clock(), span = { lo: 0, hi: L.end, label: "t [s]" };
  const energy = new Plot($("[data-energy]", element), { x: span, y: { lo: 1e-10, hi: 1e4, log: true, label: "|H − H₀| [J]" } });
  const rank = new Plot($("[data-rank]", element), { x: span, y: { lo: 1e-5, hi: 1, log: true, label: "smaller / larger singular value of G" } });
  const crank = new Picture($("[data-crank]", element), draw);
  const rod = control(element, "rod", () => again(), (k) => shown(L.rods[k], 4)), h = control(element, "h", () => again(), (k) => `${L.h[k]} s`);
  /** A run of the mechanism: its energy errors, the ratio of the singular values of G, and the positions. */
  function locked(name, index, step) {
    const run = new Run(methods[`crank ${name}`]), { state, par } = L.runs[index][name], n = Math.round(L.end / step), rows = new Float64Array(6 * n);
    run.P.set(par);
    run.begin(state, step).advance(n, 1, rows);
    const H0 = value("crank", "H", state, par), made = { status: run.steps === n ? 0 : run.status, t: run.t, steps: run.steps, x: [], error: [], rank: [], q: [], worst: 0, least: 1 };
    for (let k = 0; k <= run.steps; k++) {
      const x = k ? rows.subarray(6 * k - 6, 6 * k) : state, error = Math.abs(value("crank", "H", x, par) - H0);
      functions.crank.G(x, par, O);
      const [a, b, c, d, e, f] = O, trace = a * a + b * b + c * c + d * d + e * e + f * f, det = (a * e - b * d) ** 2 + (a * f - c * d) ** 2 + (b * f - c * e) ** 2;
      const large = (trace + Math.sqrt(Math.max(trace * trace - 4 * det, 0))) / 2, ratio = Math.sqrt(det) / large;
      made.x.push(k * step); made.error.push(Math.max(error, 1e-17)); made.rank.push(ratio); made.q.push([x[3], x[4], x[5]]);
      made.worst = Math.max(made.worst, error); made.least = Math.min(made.least, ratio);
    }
    return made;
  }
  let made = {};
  function again() { for (const name of L.methods) made[name] = locked(name, rod(), L.h[h()]); clock.t = STILL.matches ? L.end : 0; show(); }
  function show() {
    const n = Math.floor(clock.t / L.h[h()]) + 1;
    energy.curves = L.methods.map((name) => upto({ x: made[name].x, y: made[name].error, colour: colours[name], name: names[name] }, n));
    rank.curves = [upto({ x: made.rattle.x, y: made.rattle.rank, colour: colours.rattle }, n)];
    const ended = L.methods.filter((name) => made[name].status && clock.t >= made[name].t);
    energy.marks = ended.map((name, k) => ({ x: made[name].t, colour: colours[name], row: k, text: `${names[name]}: ${M.statuses[made[name].status]}` }));
    [energy, rank, crank].forEach((picture) => picture.draw());
    const { worst, least } = made.rattle;
    $("[data-meter]", element).textContent = `largest energy error: RATTLE ${shown(worst, 2)} J, RK4 ${shown(made.rk4.worst, 2)} J · the smaller singular value of G decreases to ${shown(least, 2)} of the larger one`;
  }
  function draw(pen, width, height) {
    const { q, steps } = made.rattle, [x, y, slide] = q[Math.min(Math.floor(clock.t / L.h[h()]), steps)], r = Math.min(width / 4.6, height / 2.6), left = width / 2 - r, at = (a, b) => [left + r * a, height / 2 - r * b], ink = colour("--ink");
    pen.lineWidth = 1; line(pen, [at(-1.2, 0), at(3.2, 0)], colour("--rule"));
    pen.strokeStyle = colour("--rule"); pen.beginPath(); pen.arc(...at(0, 0), r, 0, 7); pen.stroke();
    pen.lineWidth = 5; line(pen, [at(0, 0), at(x, y)], ink);
    pen.lineWidth = 4; line(pen, [at(x, y), at(slide, 0)], colours.rattle);
    const [a, b] = at(slide, 0);
    pen.fillStyle = colours.rattle; pen.fillRect(a - 14, b - 9, 28, 18);
    for (const place of [at(0, 0), at(x, y)]) { pen.fillStyle = ink; pen.beginPath(); pen.arc(...place, 5, 0, 7); pen.fill(); }
    pen.textAlign = "left"; pen.textBaseline = "bottom"; pen.fillText("RATTLE", 4, height - 6);
  }
  again();
  Frames.add(element, (dt) => { clock.tick(0.35 * dt, L.end); show(); });
  const [long, short, stuck] = [0, L.nearly, L.rods.length - 1].map((k) => locked("rattle", k, L.step)), fill = (name, text) => { $(`[data-fill="${name}"]`).textContent = text; };
  globalThis.lock = { long: long.worst, short: short.worst, status: stuck.status, locks: stuck.t };
  fill("long", shown(long.worst, 2)); fill("short", shown(short.worst, 2)); fill("locks", shown(stuck.t, 2));
}

/* ---------- a stiff spring ---------- */
{
  const element = $("#stiff"), S = DATA.stiff, { end, h: steps } = S, clock = new Clock(), span = { lo: 0, hi: end, label: "t [s]" };
  const away = new Plot($("[data-away]", element), { x: span, y: { lo: 1e-9, hi: 1e2, log: true, label: "|q − q constrained| [m]" } });
  const residual = new Plot($("[data-g]", element), { x: span, y: { lo: 1e-9, hi: 1e2, log: true, label: "|g|" } });
  const globe = new Sphere($("[data-globe]", element), new View(0.4, 0.3)), held = new Run(methods.held);
  globe.room = 1.5; globe.colour = colours["stiff:midpoint"];
  const eps = control(element, "eps", () => again(), (k) => shown(S.eps[k], 1)), h = control(element, "h", () => again(), (k) => `${steps[k]} s`);
  function penalised(name, index, step) {
    const run = new Run(methods[name]), { state, par } = S.runs[index][name], n = Math.round(end / step), rows = new Float64Array(6 * n), exact = new Float64Array(6 * n);
    run.P.set(par);
    run.begin(state, step).advance(n, 1, rows);
    held.begin(held.method.state, step).advance(n, 1, exact);
    const made = { status: run.status, t: run.t, steps: run.steps, x: [0], away: [1e-17], g: [Math.max(Math.abs(value("pendulum", "g", state, par)), 1e-17)], rows, largest: 0 };
    for (let k = 0; k < run.steps; k++) {
      const at = 6 * k, g = Math.abs(value("pendulum", "g", rows.subarray(at, at + 6), par));
      made.x.push((k + 1) * step); made.away.push(Math.hypot(...[3, 4, 5].map((i) => rows[at + i] - exact[at + i]))); made.g.push(Math.max(g, 1e-17));
      made.largest = Math.max(made.largest, g);
    }
    return made;
  }
  let made = {};
  function again() { for (const name of S.methods) made[name] = penalised(name, eps(), steps[h()]); clock.t = STILL.matches ? end : 0; show(); }
  function show() {
    const step = steps[h()], n = Math.floor(clock.t / step) + 1;
    const curves = (part) => S.methods.map((name) => upto({ x: made[name].x, y: made[name][part], colour: colours[name], name: names[name] }, n));
    away.curves = curves("away"); residual.curves = curves("g");
    away.marks = S.methods.filter((name) => made[name].status && clock.t >= made[name].t).map((name, k) => ({ x: made[name].t, colour: colours[name], row: k, text: `${names[name]}: ${M.statuses[made[name].status]}` }));
    globe.trails = S.methods.map((name) => { const trail = new Trail(160, colours[name]); for (let k = Math.max(0, n - 160); k < Math.min(n, made[name].steps); k++) trail.add(...made[name].rows.subarray(6 * k + 3, 6 * k + 6)); return trail; });
    const rows = made["stiff:midpoint"].rows, k = Math.min(n, made["stiff:midpoint"].steps) - 1;
    globe.bob = k < 0 ? held.method.state.slice(3) : [...rows.subarray(6 * k + 3, 6 * k + 6)];
    [away, residual, globe].forEach((picture) => picture.draw());
    $("[data-meter]", element).textContent = `the spring oscillates in ${shown(Math.PI * S.eps[eps()], 2)} s: a step is ${shown(step / (Math.PI * S.eps[eps()]), 2)} of that · |g| at most: RK4 ${shown(made["stiff:rk4"].largest, 2)}, midpoint rule ${shown(made["stiff:midpoint"].largest, 2)}`;
  }
  again();
  Frames.add(element, (dt) => { clock.tick(0.5 * dt, end); show(); });
  const tight = S.eps.indexOf(S.tight), [rk4, midpoint] = S.methods.map((name) => penalised(name, tight, S.step)), fill = (name, text) => { $(`[data-fill="${name}"]`).textContent = text; };
  const loose = penalised("stiff:midpoint", S.eps.length - 1, S.step), distance = Math.max(...loose.away), rod = loose.g.map((_, k) => k && value("pendulum", "g", loose.rows.subarray(6 * k - 6, 6 * k), methods.held.par));
  const turns = rod.slice(2).filter((g, k) => (g > rod[k + 1]) !== (rod[k + 1] > rod[k])).length / (rod.length - 2);
  globalThis.stiff = { away: distance, unresolved: loose.status, turns, ends: rk4.t, failed: rk4.status, reaches: midpoint.t, works: midpoint.status, g: midpoint.largest };
  fill("ends", shown(rk4.t, 2)); fill("reaches", shown(midpoint.t, 2)); fill("g", shown(midpoint.largest, 1)); fill("away", shown(distance, 1));
}

/* ---------- a long sum ---------- */
{
  const element = $("#rounding"), R = DATA.rounding, H_ = R.h, most = 1e7, rows = new Float64Array(6 * 64);
  const plot = new Plot($("[data-error]", element), { x: { lo: 10, hi: most, log: true, label: "steps N" }, y: { lo: 1e-19, hi: 1e-12, log: true, label: "largest |L₃ − L₃(0)| [J s]" }, rows: true });
  const h = control(element, "h", () => again(), (k) => `${H_[k]} s`), momentum = (x, k = 0) => x[k + 3] * x[k + 1] - x[k + 4] * x[k];
  const inks = () => [colours.rattle, colours.lobatto3];
  class Sum {
    constructor(name, step) { this.run = new Run(methods[name]); this.run.begin(this.run.method.state, step); Object.assign(this, { first: momentum(this.run.method.state), worst: 0, x: [], y: [] }); }
    advance(n) {
      this.run.advance(n, Math.max(1, Math.ceil(n / 60)), rows);
      for (let k = 0; k < this.run.rows; k++) this.worst = Math.max(this.worst, Math.abs(momentum(rows, 6 * k) - this.first));
      this.x.push(this.run.steps); this.y.push(Math.max(this.worst, 1e-19));
      return this;
    }
    to(n) { while (this.run.steps < n) this.advance(Math.min(n - this.run.steps, Math.max(10, Math.floor(0.1 * this.run.steps)), 5000)); return this; }
  }
  let sums, n;
  function again() { sums = R.names.map((name) => new Sum(name, H_[h()])); n = 10; sums.forEach((sum) => sum.to(STILL.matches ? 2e5 : n)); show(); }
  function show() {
    const walk = { x: [], y: [], colour: colour("--quiet"), dash: [5, 4], name: "√N roundings", width: 1.3 }, unit = Math.abs(sums[0].first) * 2 ** -53;
    for (let x = 10; x <= most; x *= 10) { walk.x.push(x); walk.y.push(unit * Math.sqrt(x)); }
    plot.curves = [...sums.map(({ x, y }, k) => ({ x, y, colour: inks()[k], name: R.names[k] })), walk];
    plot.draw();
    $("[data-meter]", element).textContent = `${count(sums[0].run.steps)} steps · ` + sums.map(({ worst }, k) => `${R.names[k]} ${shown(worst, 2)} J s`).join(" · ");
  }
  $("[data-again]", element).addEventListener("click", again);
  again();
  Frames.add(element, () => {
    if (n >= most) return;
    n = Math.min(most, n + Math.min(5000, Math.max(5, Math.floor(0.03 * n))));
    sums.forEach((sum) => sum.to(n));
    if (sums[0].x.length > 1500) sums.forEach((sum) => { for (const part of ["x", "y"]) sum[part] = sum[part].filter((_, k) => k % 2 || k > 1400); });
    show();
  });
  const [plain, compensated] = R.names.map((name) => new Sum(name, R.step).to(R.many)), fill = (name, text) => { $(`[data-fill="${name}"]`).textContent = text; };
  globalThis.rounding = { plain: plain.worst, compensated: compensated.worst };
  fill("many", count(R.many)); fill("plain", shown(plain.worst, 2)); fill("compensated", shown(compensated.worst, 2));
}
Frames.start();

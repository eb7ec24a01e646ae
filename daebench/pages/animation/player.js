"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const find = (name) => document.getElementById(name);
  const [play, slider, now, speed] = ["play", "time", "now", "speed"].map(find);
  const last = data.frames - 1;

  const bytes = (text) => new DataView(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const int16 = (text) => { const view = bytes(text); return Int16Array.from({length: view.byteLength / 2}, (_, i) => view.getInt16(2 * i, true)); };
  const float32 = (text) => { const view = bytes(text); return Float32Array.from({length: view.byteLength / 4}, (_, i) => view.getFloat32(4 * i, true)); };

  const figures = [...document.querySelectorAll(".run")];
  const runs = data.runs.map((run, k) => ({
    points: int16(run.points),
    shown: int16(run.shown),
    end: run.end,
    failed: run.failed,
    errors: Object.fromEntries(Object.entries(run.errors).map(([name, text]) => [name, float32(text)])),
    figure: figures[k],
    paths: Object.fromEntries(["trail", "springs", "dampers", "rods", "masses"].map((kind) => [kind, figures[k].querySelector("path." + kind)])),
    readings: [...figures[k].querySelectorAll("dd")],
  }));
  const cursors = [...document.querySelectorAll(".graphs svg")].map((svg) => {
    const [left, top, width, height] = svg.querySelector(".panel").dataset.frame.split(" ").map(Number);
    const line = document.createElementNS("http://www.w3.org/2000/svg", "path");
    line.setAttribute("class", "cursor");
    line.setAttribute("d", `M${left} ${top}v${height}`);
    svg.append(line);
    svg.addEventListener("click", (event) => {
      const box = svg.getBoundingClientRect();
      const share = ((event.clientX - box.left) / box.width * svg.viewBox.baseVal.width - left) / width;
      show(Math.round(Math.min(1, Math.max(0, share)) * last));
      stop();
    });
    return {line, width};
  });

  const MISSING = -32768;
  const at = (run, state, point) => {
    const i = 2 * (state * data.points + point);
    return run.points[i] === MISSING ? null : (run.points[i] / data.scale).toFixed(1) + " " + (run.points[i + 1] / data.scale).toFixed(1);
  };
  const line = (points) => {
    let path = "", pen = "M";
    for (const point of points) {
      if (point === null) { pen = "M"; continue; }
      path += pen + point;
      pen = "L";
    }
    return path;
  };
  const zigzag = ([first, second]) => {
    if (first === null || second === null) return [];
    const [a, b] = [first, second].map((text) => text.split(" ").map(Number));
    const leg = [b[0] - a[0], b[1] - a[1]], length = Math.hypot(...leg) || 1, {corners, end, amplitude} = data.zigzag;
    const side = Math.min(amplitude, length / 8) / length;
    const corner = (along, aside) => (a[0] + along * leg[0] + aside * side * leg[1]).toFixed(1) + " " + (a[1] + along * leg[1] - aside * side * leg[0]).toFixed(1);
    const inner = Array.from({length: corners + 2}, (_, i) => corner(end + (1 - 2 * end) * i / (corners + 1), i === 0 || i === corners + 1 ? 0 : (-1) ** (i - 1)));
    return [corner(0, 0), ...inner, corner(1, 0)];
  };
  const draw = (run, frame) => {
    const state = run.shown[frame], start = run.shown[Math.max(0, frame - data.trail)];
    const back = Array.from({length: state - start + 1}, (_, i) => start + i);
    run.paths.trail.setAttribute("d", data.trails.map((k) => line(back.map((each) => at(run, each, k)))).join(""));
    const ends = (pairs) => pairs.map((pair) => pair.map((k) => at(run, state, k)));
    if (run.paths.springs) run.paths.springs.setAttribute("d", ends(data.springs).map((pair) => line(zigzag(pair))).join(""));
    if (run.paths.dampers) run.paths.dampers.setAttribute("d", ends(data.dampers).map(line).join(""));
    run.paths.rods.setAttribute("d", data.rods.map((rod) => line(rod.map((k) => at(run, state, k)))).join(""));
    run.paths.masses.setAttribute("d", data.masses.map((k) => at(run, state, k)).filter((p) => p !== null).map((p) => `M${p}h0`).join(""));
    run.figure.classList.toggle("ended", run.failed && frame * data.step > run.end);
    for (const reading of run.readings) {
      const value = run.errors[reading.dataset.error][state];
      reading.textContent = !Number.isFinite(value) ? "\u2013" : value === 0 ? "0" : value.toExponential(1);
    }
  };

  let frame = 0, clock = null, began = 0;
  const show = (wanted) => {
    frame = wanted;
    runs.forEach((run) => draw(run, frame));
    cursors.forEach(({line, width}) => line.setAttribute("transform", `translate(${(width * frame / last).toFixed(2)} 0)`));
    const told = "t = " + (frame * data.step).toPrecision(4);
    slider.value = frame;
    slider.setAttribute("aria-valuetext", told);
    now.textContent = told;
  };
  const tick = (time) => {
    const wanted = Math.min(last, Math.floor((time - began) / 1000 * data.fps * Number(speed.value)));
    if (wanted > frame) show(wanted);
    if (frame >= last) stop(); else clock = requestAnimationFrame(tick);
  };
  const from = (time) => { began = time - 1000 * frame / (data.fps * Number(speed.value)); };
  const start = () => {
    if (frame >= last) show(0);
    play.textContent = "Pause";
    clock = requestAnimationFrame((time) => { from(time); tick(time); });
  };
  const stop = () => {
    if (clock !== null) cancelAnimationFrame(clock);
    clock = null;
    play.textContent = "Play";
  };

  play.addEventListener("click", () => (clock === null ? start() : stop()));
  slider.addEventListener("input", () => { stop(); show(Number(slider.value)); });
  speed.addEventListener("change", () => { if (clock !== null) from(performance.now()); });
  document.querySelectorAll(".controls, dl").forEach((each) => each.removeAttribute("hidden"));
  show(0);
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) start();
})();

"use strict";
(() => {
  const data = JSON.parse(document.getElementById("motions").textContent), still = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const PAUSE = 1, TRAIL = 22;  // seconds between two showings; frames of a trail
  const shown = new Set(), canvases = [...document.querySelectorAll("canvas[data-scene]")];
  let running = !still, since = 0, time = 0;

  const draw = (canvas, now) => {
    const scene = data.scenes[canvas.dataset.scene], pen = canvas.getContext("2d"), ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(width * data.height / data.width);
    if (canvas.width !== width) [canvas.width, canvas.height] = [width, height];
    const unit = width / data.width;
    const ink = getComputedStyle(canvas).getPropertyValue("--ink").trim() || "#1d1d1f";
    const place = (k, n) => {
      const places = scene.points[k];
      if (places.length === 2) return [places[0] * unit, places[1] * unit];
      const i = Math.min(Math.floor(n), data.frames - 1), share = n - i;
      return [0, 1].map((axis) => unit * (places[2 * i + axis] * (1 - share) + places[2 * i + 2 + axis] * share));
    };
    const line = (points) => { pen.beginPath(); points.forEach(([x, y]) => pen.lineTo(x, y)); pen.stroke(); };
    const look = (color, thick, alpha) => { pen.strokeStyle = pen.fillStyle = color; pen.lineWidth = thick * ratio; pen.globalAlpha = alpha; };
    const coil = ([a, b]) => {
      const [dx, dy] = [b[0] - a[0], b[1] - a[1]], length = Math.hypot(dx, dy) || 1, wide = Math.min(22 * unit, length / 6);
      const at = (along, aside) => [a[0] + along * dx - aside * dy / length, a[1] + along * dy + aside * dx / length];
      return [a, ...Array.from({ length: 12 }, (_, i) => at(0.15 + 0.7 * i / 11, i % 11 ? wide * (-1) ** i : 0)), b];
    };
    pen.clearRect(0, 0, width, canvas.height);
    pen.lineJoin = pen.lineCap = "round";
    look(ink, 0.6, 0.22);
    for (const places of scene.surface) line(Array.from({ length: places.length / 2 }, (_, i) => [unit * places[2 * i], unit * places[2 * i + 1]]));
    scene.paths.forEach((k, number) => {
      look(data.colors[number % data.colors.length], 1, 0.3);
      line(Array.from({ length: data.frames + 1 }, (_, i) => place(k, i)));
      look(data.colors[number % data.colors.length], 1.6, 1);
      const first = Math.max(0, now - TRAIL);
      line([...Array.from({ length: Math.max(0, Math.ceil(now) - Math.floor(first)) }, (_, i) => place(k, Math.max(first, Math.floor(first) + i))), place(k, now)]);
    });
    look(ink, 1.2, 0.8);
    for (const ends of scene.springs) line(coil(ends.map((k) => place(k, now))));
    pen.setLineDash([4 * ratio, 4 * ratio]);
    for (const ends of scene.dampers) line(ends.map((k) => place(k, now)));
    pen.setLineDash([]);
    look(ink, 2.2, 1);
    for (const rod of scene.rods) line(rod.map((k) => place(k, now)));
    look(data.mass, 1, 1);
    for (const k of scene.masses) { pen.beginPath(); pen.arc(...place(k, now), 4.5 * ratio, 0, 7); pen.fill(); }
    look(ink, 1.2, 1);
    for (const k of scene.fixed) {
      const [x, y] = place(k, now), r = 4.5 * ratio;
      pen.beginPath(); pen.moveTo(x, y - r); pen.lineTo(x + r, y + r); pen.lineTo(x - r, y + r); pen.closePath(); pen.stroke();
    }
    canvas.dataset.frame = now.toFixed(2);
  };

  const frame = () => data.frames * Math.min(1, (time % (data.seconds + PAUSE)) / data.seconds);
  const button = document.getElementById("play-scenes");
  const say = () => { button.textContent = running ? "Stop" : "Play"; };
  button.addEventListener("click", () => { running = !running; say(); });
  const seen = new IntersectionObserver((entries) => entries.forEach((entry) => {
    if (entry.isIntersecting) { shown.add(entry.target); draw(entry.target, frame()); } else shown.delete(entry.target);
  }));
  canvases.forEach((canvas) => { draw(canvas, 0); seen.observe(canvas); });
  const again = () => canvases.forEach((canvas) => draw(canvas, frame()));
  addEventListener("resize", again);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
  addEventListener("beforeprint", () => canvases.forEach((canvas) => draw(canvas, 0)));
  const tick = (at) => {
    if (running) time += Math.min(100, at - since) / 1000;
    since = at;
    if (running) shown.forEach((canvas) => draw(canvas, frame()));
    requestAnimationFrame(tick);
  };
  say();
  requestAnimationFrame(tick);
})();

"use strict";
for (const figure of document.querySelectorAll("figure.zoomable")) {
  const data = JSON.parse(figure.querySelector("script").textContent);
  const bytes = name => Uint8Array.from(atob(data.series[name]), c => c.charCodeAt(0)).buffer;
  const angles = (name, origin) => Float64Array.from(new Float32Array(bytes(name)), value => value + origin);
  const t = new Float64Array(bytes("t")), origin = data.series.origin;
  const [y, mean, lower, upper] = ["y", "mean", "lower", "upper"].map(name => angles(name, origin));
  const residual = angles("residual", 0);
  const whole = [t[0], t[t.length - 1]];
  const shortest = (whole[1] - whole[0]) / t.length * 8;
  const canvas = figure.querySelector("canvas");
  const button = figure.querySelector("button"), pen = canvas.getContext("2d");
  let view = [...whole], drag = null, waiting = false;
  figure.classList.add("zooming");

  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
  const frame = () => ({ left: 64, right: canvas.clientWidth - 8 });
  const toTime = x => view[0] + (x - frame().left) / (frame().right - frame().left) * (view[1] - view[0]);
  const indexOf = time => {
    let low = 0, high = t.length - 1;
    while (low < high) { const middle = (low + high) >> 1; if (t[middle] < time) low = middle + 1; else high = middle; }
    return low;
  };
  const setView = (from, to) => {
    const length = clamp(to - from, shortest, whole[1] - whole[0]);
    const start = clamp(from, whole[0], whole[1] - length);
    view = [start, start + length];
    button.hidden = length >= whole[1] - whole[0];
    if (!waiting) { waiting = true; requestAnimationFrame(draw); }
  };
  const zoom = (factor, centre) => setView(centre - (centre - view[0]) * factor, centre + (view[1] - centre) * factor);
  const ticks = (low, high, count) => {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find(factor => factor * power >= raw);
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), values = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++)
      values.push([k * step, (k * step).toFixed(digits).replace("-", "−")]);
    return values;
  };

  function panel(box, names, unit, timeAxis) {
    const css = getComputedStyle(figure), role = name => css.getPropertyValue("--" + name);
    const first = Math.max(0, indexOf(view[0]) - 1), last = Math.min(t.length - 1, indexOf(view[1]) + 1);
    let low = Infinity, high = -Infinity;
    for (const { values } of names) for (let k = first; k <= last; k++) { low = Math.min(low, values[k]); high = Math.max(high, values[k]); }
    const margin = (high - low) * 0.06 || 1; low -= margin; high += margin;
    const x = time => box.left + (time - view[0]) / (view[1] - view[0]) * (box.right - box.left);
    const py = value => box.bottom - (value - low) / (high - low) * (box.bottom - box.top);
    pen.font = "12px system-ui, sans-serif"; pen.lineWidth = 1; pen.strokeStyle = role("line"); pen.fillStyle = role("muted");
    pen.textAlign = "right"; pen.textBaseline = "middle"; pen.beginPath();
    for (const [value, label] of ticks(low, high, Math.max(3, (box.bottom - box.top) / 45))) {
      pen.moveTo(box.left, py(value)); pen.lineTo(box.right, py(value)); pen.fillText(label, box.left - 6, py(value));
    }
    pen.textAlign = "center"; pen.textBaseline = "top";
    for (const [value, label] of ticks(view[0], view[1], (box.right - box.left) / 90)) {
      pen.moveTo(x(value), box.top); pen.lineTo(x(value), box.bottom);
      if (timeAxis) pen.fillText(label, x(value), box.bottom + 5);
    }
    pen.stroke();
    if (timeAxis) pen.fillText("time (" + data.time_unit + ")", (box.left + box.right) / 2, box.bottom + 20);
    pen.save(); pen.translate(11, (box.top + box.bottom) / 2); pen.rotate(-Math.PI / 2); pen.textBaseline = "middle"; pen.fillText(unit, 0, 0); pen.restore();
    pen.save(); pen.beginPath(); pen.rect(box.left, box.top, box.right - box.left, box.bottom - box.top); pen.clip();
    // One column of pixels keeps the smallest and the largest of its samples.
    const columns = Math.max(1, Math.round(box.right - box.left)), dense = last - first > 3 * columns;
    const outline = (values, pick) => {
      const points = [];
      if (!dense) { for (let k = first; k <= last; k++) points.push([x(t[k]), py(values[k])]); return points; }
      for (let column = 0; column < columns; column++) {
        const from = first + Math.floor((last - first) * column / columns), to = first + Math.floor((last - first) * (column + 1) / columns);
        let extreme = values[from];
        for (let k = from; k <= to; k++) if (pick === "low" ? values[k] < extreme : values[k] > extreme) extreme = values[k];
        points.push([x(t[from]), py(extreme)]);
      }
      return points;
    };
    for (const { values, other, colour } of names) {
      pen.beginPath(); pen.lineWidth = 1.4; pen.strokeStyle = pen.fillStyle = role(colour);
      if (other) {
        [...outline(values, "low"), ...outline(other, "high").reverse()].forEach(([a, b]) => pen.lineTo(a, b));
        pen.fill();
      } else if (dense) {
        const tops = outline(values, "high");
        outline(values, "low").forEach(([a, b], k) => { pen.lineTo(a, b); pen.lineTo(tops[k][0], tops[k][1]); });
        pen.stroke();
      } else { outline(values).forEach(([a, b]) => pen.lineTo(a, b)); pen.stroke(); }
    }
    if (drag && !drag.move) { pen.globalAlpha = 0.15; pen.fillStyle = role("ink"); pen.fillRect(drag.x, box.top, drag.now - drag.x, box.bottom - box.top); }
    pen.restore();
  }

  function draw() {
    waiting = false;
    const scale = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = Math.round(width * scale); canvas.height = Math.round(height * scale);
    pen.setTransform(scale, 0, 0, scale, 0, 0); pen.clearRect(0, 0, width, height);
    const split = Math.round(height * 0.62), { left, right } = frame();
    panel({ left, right, top: 6, bottom: split }, [{ values: lower, other: upper, colour: "band" }, { values: y, colour: "data" }, { values: mean, colour: "model" }], "output (" + data.output_unit + ")", false);
    panel({ left, right, top: split + 16, bottom: height - 40 }, [{ values: residual, colour: "residual" }], "residual (" + data.output_unit + ")", true);
  }

  canvas.addEventListener("wheel", event => { event.preventDefault(); zoom(Math.exp(clamp(event.deltaY, -200, 200) * 0.002), toTime(event.offsetX)); }, { passive: false });
  canvas.addEventListener("pointerdown", event => { canvas.setPointerCapture(event.pointerId); drag = { x: event.offsetX, now: event.offsetX, move: event.shiftKey, view: [...view] }; });
  canvas.addEventListener("pointermove", event => {
    if (!drag) return;
    drag.now = event.offsetX;
    const shift = drag.move ? (drag.x - drag.now) / (frame().right - frame().left) * (drag.view[1] - drag.view[0]) : 0;
    setView(drag.move ? drag.view[0] + shift : view[0], drag.move ? drag.view[1] + shift : view[1]);
  });
  canvas.addEventListener("pointerup", () => {
    if (!drag) return;
    const [from, to] = [drag.x, drag.now].sort((a, b) => a - b), moved = drag.move;
    drag = null;
    if (!moved && to - from > 6) setView(toTime(from), toTime(to)); else setView(...view);
  });
  canvas.addEventListener("pointercancel", () => { drag = null; setView(...view); });
  canvas.addEventListener("dblclick", () => setView(...whole));
  button.addEventListener("click", () => setView(...whole));
  canvas.addEventListener("keydown", event => {
    const centre = (view[0] + view[1]) / 2, step = (view[1] - view[0]) / 5;
    const act = { "+": () => zoom(0.7, centre), "=": () => zoom(0.7, centre), "-": () => zoom(1 / 0.7, centre), "ArrowLeft": () => setView(view[0] - step, view[1] - step), "ArrowRight": () => setView(view[0] + step, view[1] + step), "0": () => setView(...whole) }[event.key];
    if (act) { event.preventDefault(); act(); }
  });
  new ResizeObserver(() => setView(...view)).observe(canvas);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => setView(...view));
}

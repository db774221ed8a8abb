"use strict";
const plots = JSON.parse(document.getElementById("plots").textContent);
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
const colour = role => getComputedStyle(document.documentElement).getPropertyValue("--" + role).trim();
const short = value => value == null ? "" : Math.abs(value) >= 1e5 || (value !== 0 && Math.abs(value) < 1e-3)
  ? value.toExponential(2).replace(/\.?0*e/, "e").replace("e+", "e").replaceAll("-", "−") : String(+value.toPrecision(5)).replace("-", "−");
const roles = { command: "muted", angle: "model", error: "residual" };
const marks = ["model", "residual", "muted"];
let drawn = [];

// Width of an axis of values: its ticks, with room for eight characters; the label takes 20 more.
const SIDE = 64;
const ruler = document.createElement("canvas").getContext("2d");

// The label beside the axis where the plot is as high as it is long, else above the plot.
function sideLabel(place, label, height) {
  ruler.font = "12px system-ui, sans-serif";
  if (ruler.measureText(label).width <= height) return label;
  const above = document.createElement("div");
  above.className = "axis-label";
  above.textContent = label;
  place.append(above);
  return null;
}

const axis = (label, size, extra) => ({
  label, labelSize: 20, size, stroke: colour("muted"), font: "11px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif",
  grid: { stroke: colour("line"), width: 1 }, ticks: { stroke: colour("line"), width: 1 },
  values: (_, ticks) => ticks.map(short), ...extra,
});

// Wheel and two fingers zoom, shift-drag and one finger move; drag and double click are uPlot's own.
function hands(chart, group) {
  const over = chart.over, whole = [chart.data[0][0], chart.data[0][chart.data[0].length - 1]];
  const set = (from, to) => {
    const length = Math.min(Math.max(to - from, (whole[1] - whole[0]) / 1e5), whole[1] - whole[0]);
    const start = Math.min(Math.max(from, whole[0]), whole[1] - length);
    for (const one of group) one.setScale("x", { min: start, max: start + length });
  };
  over.addEventListener("wheel", event => {
    event.preventDefault();
    const { min, max } = chart.scales.x, at = chart.posToVal(event.offsetX, "x");
    const factor = Math.exp(Math.max(-200, Math.min(200, event.deltaY)) * 0.002);
    set(at - (at - min) * factor, at + (max - at) * factor);
  }, { passive: false });
  const width = () => over.getBoundingClientRect().width;
  over.addEventListener("mousedown", event => {
    if (!event.shiftKey || event.button !== 0) return;
    event.stopImmediatePropagation();
    const begin = event.clientX, { min, max } = chart.scales.x;
    const move = now => { const by = (begin - now.clientX) / width() * (max - min); set(min + by, max + by); };
    document.addEventListener("mousemove", move);
    document.addEventListener("mouseup", () => document.removeEventListener("mousemove", move), { once: true });
  }, true);
  let touched = null, tapped = 0;
  over.addEventListener("touchstart", event => {
    const { min, max } = chart.scales.x;
    touched = { at: [...event.touches].map(one => one.clientX), min, max };
    if (event.touches.length === 1) { if (event.timeStamp - tapped < 300) set(...whole); tapped = event.timeStamp; }
  }, { passive: true });
  over.addEventListener("touchmove", event => {
    if (!touched || event.touches.length !== touched.at.length) return;
    const { at, min, max } = touched, now = [...event.touches].map(one => one.clientX);
    if (now.length === 1) {
      if (Math.abs(now[0] - at[0]) < 8) return;
      const by = (at[0] - now[0]) / width() * (max - min); set(min + by, max + by);
    } else {
      event.preventDefault();
      const left = over.getBoundingClientRect().left, value = x => min + (x - left) / width() * (max - min);
      const centre = value((at[0] + at[1]) / 2), factor = Math.abs(at[0] - at[1]) / Math.max(Math.abs(now[0] - now[1]), 8);
      set(centre - (centre - min) * factor, centre + (max - centre) * factor);
    }
  }, { passive: false });
}

function timePlot(place, plot) {
  const x = Float64Array.from({ length: plot.points }, (_, k) => k * plot.step), group = [], key = "sync-" + plot.id;
  plot.panels.forEach((panel, index) => {
    const last = index === plot.panels.length - 1, box = document.createElement("div");
    place.append(box);
    const label = sideLabel(box, panel.label, last ? 130 : 115);
    const y = Float64Array.from(new Float32Array(bytes(panel.values)), value => value + panel.origin);
    const chart = new uPlot({
      width: place.clientWidth, height: last ? 190 : 140, legend: { show: false },
      cursor: { sync: { key, scales: ["x", null] }, drag: { x: true, y: false } },
      scales: { x: { time: false } },
      axes: [last ? axis(plot.x_label, 34) : axis(null, 10, { labelSize: 0, values: (_, ticks) => ticks.map(() => "") }), axis(label, label ? SIDE : SIDE + 20)],
      series: [{}, { stroke: colour(roles[panel.role]), width: 1.2, points: { show: false } }],
      hooks: { setScale: [(self, name) => {
        if (name !== "x" || self.following) return;
        const { min, max } = self.scales.x;
        for (const other of group) if (other !== self && (other.scales.x.min !== min || other.scales.x.max !== max)) {
          other.following = true; other.setScale("x", { min, max }); other.following = false;
        }
      }] },
    }, [x, y], box);
    group.push(chart);
  });
  group.forEach(chart => hands(chart, group));
  return group;
}

function curvePlot(place, plot) {
  const series = [{ label: plot.x_label, value: (_, v) => short(v) }], data = [plot.x], bands = [];
  if (plot.band) {
    place.classList.add("banded");
    for (const edge of plot.band) { series.push({ label: "94 %", stroke: "transparent", width: 0, points: { show: false }, value: (_, v) => short(v) }); data.push(edge); }
    bands.push({ series: [2, 1], fill: colour("band") });
    series[1].label = "band, low"; series[2].label = "high";
  }
  plot.series.forEach((one, k) => {
    series.push({ label: one.label, stroke: colour(marks[k]), width: 1.5, spanGaps: false, value: (_, v) => short(v),
      points: plot.points ? { show: true, size: 6, stroke: colour(marks[k]), fill: colour(marks[k]) } : { show: false } });
    data.push(one.values);
  });
  const height = Math.min(300, 160 + place.clientWidth / 6), label = sideLabel(place, plot.label, height - 65);
  const chart = new uPlot({
    width: place.clientWidth, height, bands, series,
    cursor: { drag: { x: true, y: false } },
    scales: { x: { time: false, distr: plot.log_x ? 3 : 1 }, y: { distr: plot.log_y ? 3 : 1, ...(plot.span ? { range: plot.span } : {}) } },
    axes: [axis(plot.x_label, 34), axis(label, SIDE)],
  }, data, place);
  return [chart];
}

function draw() {
  for (const chart of drawn) chart.destroy();
  drawn = [];
  for (const plot of plots) {
    const place = document.getElementById(plot.id);
    place.replaceChildren();
    drawn.push(...(plot.kind === "time" ? timePlot(place, plot) : curvePlot(place, plot)));
  }
}

draw();
let width = document.documentElement.clientWidth;
addEventListener("resize", () => {
  if (document.documentElement.clientWidth === width) return;
  width = document.documentElement.clientWidth;
  for (const chart of drawn) chart.setSize({ width: chart.root.closest(".plot").clientWidth, height: chart.height });
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);

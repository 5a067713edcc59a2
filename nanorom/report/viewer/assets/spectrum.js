// A motion in numbers: over time, line by line, and its Floquet multipliers on the unit circle.
import { Chart, polyline } from "chart";
import { h, svg } from "dom";
import * as theme from "theme";
import { largestOf, number, scaled } from "units";

const FLOOR = 1e-6; // of the largest line of a spectrum
const FARTHEST = 2; // from the origin that a multiplier is drawn at
const SIDE = 2.6; // width of the picture of the unit circle
const HEIGHT = 190;

// q over one period, with a line at the phase that is shown
export class TimeChart {
  constructor(place, label) {
    this.label = label;
    this.lines = [];
    const axes = { x: { label: "time / period of the motion", low: 0, high: 1 }, y: { label: "q (nm)", low: -1, high: 1 } };
    this.chart = new Chart(place, { ...axes, height: HEIGHT, name: "amplitudes over a period", layers: [(pen) => this.draw(pen)] });
  }

  show(series, modes) {
    const top = largestOf(series.flatMap((q) => modes.map((r) => q[r])));
    const [factor, unit] = scaled(top, "m");
    this.lines = modes.map((r) => series.map((q, i) => [i / (series.length - 1), q[r] * factor]));
    const high = 1.08 * top * factor || 1;
    this.chart.reset({ y: { label: `q (${unit})`, low: -high, high } });
  }

  draw(pen) {
    this.lines.forEach((points, i) => polyline(pen, points, { colour: theme.line(i) }));
  }

  at(phase) {
    this.chart.mark(phase);
  }
}

// Sizes of the lines of the spectrum, mode by mode, against frequency
export class SpectrumChart {
  constructor(place) {
    this.bars = [];
    const axes = { x: { label: "frequency / drive frequency", low: -0.3, high: 5 }, y: { label: "amplitude (m)", low: 1e-15, high: 1e-9, log: true } };
    this.chart = new Chart(place, { ...axes, height: HEIGHT, name: "spectrum", layers: [(pen) => this.draw(pen)] });
  }

  show(orbit, modes) {
    const lines = modes.map((r) => orbit.lines(r));
    const top = largestOf(lines.flat());
    const [factor, unit] = scaled(top, "m");
    const apart = 0.3 / Math.max(modes.length, 1) / orbit.multiple;
    this.floor = FLOOR * top * factor || 1e-6;
    this.bars = lines.flatMap((sizes, i) => sizes.map((size, k) => [
      k / orbit.multiple + (i - (modes.length - 1) / 2) * apart, size * factor, i,
    ]).filter(([, size]) => size > this.floor));
    const last = Math.max(2, ...this.bars.map(([x]) => x));
    this.chart.reset({
      x: { label: "frequency / drive frequency", low: -0.4, high: last + 0.4 },
      y: { label: `amplitude (${unit})`, low: this.floor, high: 3 * top * factor || 1, log: true },
    });
  }

  draw(pen) {
    for (const [x, size, i] of this.bars) {
      polyline(pen, [[x, pen.view.y[0]], [x, size]], { colour: theme.line(i), width: 2.5 });
    }
  }
}

// The unit circle with the multipliers [real, imaginary]; those far outside on the margin
export function multiplierPicture(multipliers) {
  const half = SIDE / 2;
  const farthest = Math.max(1.2, Math.min(FARTHEST, Math.max(...multipliers.map(([a, b]) => Math.hypot(a, b)))));
  const scale = 1.2 / farthest;
  const picture = svg("svg", { viewBox: `${-half} ${-half} ${SIDE} ${SIDE}`, class: "circle", role: "img" },
    svg("line", { x1: -half, x2: half, y1: 0, y2: 0 }), svg("line", { y1: -half, y2: half, x1: 0, x2: 0 }),
    svg("circle", { r: scale, class: "unit" }));
  const largest = multipliers.reduce((most, [a, b]) => Math.max(most, Math.hypot(a, b)), 0);
  picture.setAttribute("aria-label", `Floquet multipliers, the largest of modulus ${number(largest, 5)}`);
  for (const [real, imaginary] of multipliers) {
    const size = Math.hypot(real, imaginary);
    const shown = size > farthest ? (1.08 * farthest) / size : 1;
    const dot = svg("circle", {
      cx: real * shown * scale, cy: -imaginary * shown * scale, r: 0.045, class: size > 1 + 1e-6 ? "outside" : "inside",
    });
    dot.append(svg("title", {}, `${number(real, 6)} ${imaginary < 0 ? "−" : "+"} ${number(Math.abs(imaginary), 6)} i, modulus ${number(size, 6)}`));
    picture.append(dot);
  }
  return picture;
}

// A row per mode: its colour, name, largest amplitude and share of the energy
export function modeTable(rows) {
  const bar = (share) => {
    const filled = h("span", { className: "bar" });
    filled.style.width = `${100 * share}%`;
    return h("td", { className: "share" }, filled, h("span", {}, share === null ? "" : `${number(100 * share, 3)} %`));
  };
  const body = rows.map(({ colour, label, amplitude, share }) => {
    const swatch = h("span", { className: "swatch" });
    swatch.style.background = colour;
    return h("tr", {}, h("td", {}, swatch, " ", label), h("td", {}, amplitude), ...(share === null ? [] : [bar(share)]));
  });
  const heads = ["mode", "max |q|", ...(rows[0]?.share === null ? [] : ["share of the energy"])];
  return h("table", { className: "modes" }, h("thead", {}, h("tr", {}, ...heads.map((head) => h("th", {}, head)))), h("tbody", {}, ...body));
}

// Axes that zoom: uPlot draws the axes, layers draw what is in them, and say what lies where.
import uPlot from "uplot";
import { h, onFrame } from "dom";
import * as theme from "theme";
import { number } from "units";

const STEP = 1.5; // of a zoom by wheel, key or button
const NEAR = 28; // pixels from a point within which it is meant
const MARGIN = 8; // pixels around the axes where markers may still be drawn
const MOST_DECADES = 8; // that a logarithmic axis names
const FONT = "12px system-ui, sans-serif";

export class Chart {
  // x, y: {label, low, high, log}; layers: functions (pen) that draw; find(pen): what can be picked,
  // a list of {x, y, ...}; hover(found), pick(found), key(event): what is done about it
  constructor(place, { x, y, height = 300, layers = [], find = () => [], hover, pick, key, name }) {
    this.full = { x, y };
    this.view = { x: [x.low, x.high], y: [y.low, y.high] };
    Object.assign(this, { layers, find, hover, pick, key, height });
    this.plotted = h("div", { className: "plot", tabIndex: 0 });
    this.plotted.setAttribute("role", "application");
    this.plotted.setAttribute("aria-label", `${name}; plus and minus zoom, zero shows all`);
    this.plotted.addEventListener("keydown", (event) => this.onKey(event));
    this.line = h("span", { className: "mark", hidden: true });
    const buttons = [["+", "zoom in", 1 / STEP], ["−", "zoom out", STEP], ["⤢", "show all", 0]].map(
      ([text, title, factor]) => h("button", { type: "button", title, onclick: () => this.zoom(factor) }, text));
    place.append(h("div", { className: "chart" }, h("div", { className: "zoom" }, ...buttons), this.plotted));
    this.redraw = onFrame(() => this.plot.redraw(false));
    this.make();
    theme.onTheme(() => this.plot.redraw(false));
    new ResizeObserver(() => this.resize()).observe(this.plotted);
  }

  make() {
    const axis = (side) => ({
      label: this.full[side].label,
      labelSize: 18, labelFont: FONT, font: FONT, size: side === "x" ? 34 : 54, space: side === "x" ? 60 : 34,
      stroke: theme.text,
      grid: { stroke: theme.grid, width: 1 },
      ticks: { stroke: theme.grid, width: 1, size: 4 },
      ...(this.full[side].log ? { splits: (_, __, low, high) => decades(low, high), values: (_, places) => places.map((place) => (place === null ? "" : number(place, 3, 1e3, 1e-2))) } : {}),
    });
    const scale = (side) => ({
      time: false, auto: false, distr: this.full[side].log ? 3 : 1,
      range: () => this.view[side],
    });
    const options = {
      width: this.width(), height: this.height,
      legend: { show: false },
      scales: { x: scale("x"), y: scale("y") },
      axes: [axis("x"), axis("y")],
      series: [{}, { show: false }],
      padding: [10, 14, 0, 0],
      cursor: {
        points: { show: false },
        drag: { x: true, y: true, uni: 20, dist: 6, setScale: false },
        bind: { dblclick: () => () => this.zoom(0) },
      },
      hooks: {
        draw: [() => this.draw()],
        setSelect: [(plot) => this.select(plot)],
      },
    };
    this.plot = new uPlot(options, [[0, 1], [null, null]], this.plotted);
    this.show(this.view);
    const over = this.plot.over;
    over.append(this.line);
    over.addEventListener("mousemove", (event) => this.hover?.(this.nearest(event)));
    over.addEventListener("mouseleave", () => this.hover?.(null));
    over.addEventListener("click", (event) => {
      const found = this.nearest(event);
      if (found) this.pick?.(found);
    });
    over.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== this.plotted) return; // the page scrolls
      event.preventDefault();
      const at = [this.plot.posToVal(event.offsetX, "x"), this.plot.posToVal(event.offsetY, "y")];
      this.zoom(event.deltaY > 0 ? STEP : 1 / STEP, at);
    }, { passive: false });
  }

  width() {
    return Math.max(this.plotted.clientWidth, 200);
  }

  resize() {
    const width = this.width();
    if (width !== this.plot.width) this.plot.setSize({ width, height: this.height });
  }

  // Other axes, in other units; the zoom is given up.
  reset(axes) {
    Object.assign(this.full, axes);
    this.view = { x: this.ends("x"), y: this.ends("y") };
    this.plot.destroy();
    this.make();
  }

  ends(side) {
    return [this.full[side].low, this.full[side].high];
  }

  show(view) {
    this.view = view;
    this.plot.batch(() => {
      for (const side of ["x", "y"]) {
        this.plot.setScale(side, { min: view[side][0], max: view[side][1] });
      }
    });
    this.plot.redraw(false, true);
  }

  select(plot) {
    const { left, top, width, height } = plot.select;
    if (width < 4 || height < 4) return;
    const side = (a, b, name) => [plot.posToVal(a, name), plot.posToVal(b, name)];
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.show({ x: side(left, left + width, "x"), y: side(top + height, top, "y") });
  }

  // By a factor about a point (the middle if left out); 0 shows all.
  zoom(factor, at) {
    if (factor === 0) return this.show({ x: this.ends("x"), y: this.ends("y") });
    const about = (side, number) => {
      const turn = this.full[side].log ? [Math.log, Math.exp] : [(v) => v, (v) => v];
      const [low, high] = this.view[side].map(turn[0]);
      const middle = at ? turn[0](at[number]) : (low + high) / 2;
      return [low, high].map((end) => turn[1](middle + (end - middle) * factor));
    };
    return this.show({ x: about("x", 0), y: about("y", 1) });
  }

  onKey(event) {
    const factor = { "+": 1 / STEP, "=": 1 / STEP, "-": STEP, 0: 0 }[event.key];
    if (factor !== undefined && !event.ctrlKey && !event.metaKey) this.zoom(factor);
    else if (!this.key?.(event)) return;
    event.preventDefault();
  }

  // A line upright at x that moves without a new picture of the axes: that would cost more than the film.
  mark(x) {
    this.marked = x;
    const [low, high] = this.view.x;
    this.line.hidden = !(x >= low && x <= high);
    if (!this.line.hidden) this.line.style.transform = `translateX(${this.plot.valToPos(x, "x")}px)`;
  }

  pen() {
    const { plot } = this;
    return {
      context: plot.ctx,
      pixel: devicePixelRatio,
      x: (value) => plot.valToPos(value, "x", true),
      y: (value) => plot.valToPos(value, "y", true),
      box: plot.bbox,
      view: this.view,
    };
  }

  draw() {
    if (!this.plot) return; // uPlot draws while it is made
    const pen = this.pen();
    const { context, box } = pen;
    const margin = MARGIN * pen.pixel;
    context.save();
    context.beginPath();
    context.rect(box.left - margin, box.top - margin, box.width + 2 * margin, box.height + 2 * margin);
    context.clip();
    for (const layer of this.layers) layer(pen);
    context.restore();
    this.mark(this.marked);
  }

  nearest(event) {
    const pen = this.pen();
    const [left, top] = [event.offsetX * pen.pixel + pen.box.left, event.offsetY * pen.pixel + pen.box.top];
    let [best, least] = [null, NEAR * pen.pixel];
    for (const found of this.find(pen)) {
      const away = Math.hypot(pen.x(found.x) - left, pen.y(found.y) - top) * (found.weight ?? 1);
      if (away < least) [best, least] = [found, away];
    }
    return best;
  }
}

// Places on a logarithmic axis: powers of ten, with 2 and 5 times these where there are few, or
// equal steps where there are none.
function decades(low, high) {
  const powers = [];
  const [first, last] = [Math.floor(Math.log10(low)), Math.log10(high)];
  const step = Math.ceil((last - first) / MOST_DECADES);
  for (let k = first; k <= last; k += step) powers.push(10 ** k);
  const within = (places) => places.filter((place) => place >= low && place <= high);
  if (within(powers).length > 2) return within(powers);
  const finer = within(powers.flatMap((power) => [power, 2 * power, 5 * power]));
  return finer.length > 1 ? finer : [0.1, 0.5, 0.9].map((x) => Number((low + x * (high - low)).toPrecision(3)));
}

// A broken line through [x, y] points; what is no number is a gap.
export function polyline(pen, points, { colour, width = 1.5, dash = [] }) {
  const { context, pixel } = pen;
  context.strokeStyle = colour;
  context.lineWidth = width * pixel;
  context.setLineDash(dash.map((length) => length * pixel));
  context.lineJoin = "round";
  context.beginPath();
  let drawing = false;
  for (const [x, y] of points) {
    const known = Number.isFinite(x) && Number.isFinite(y);
    if (known && drawing) context.lineTo(pen.x(x), pen.y(y));
    else if (known) context.moveTo(pen.x(x), pen.y(y));
    drawing = known;
  }
  context.stroke();
  context.setLineDash([]);
}

const CORNERS = { s: [4, Math.PI / 4], D: [4, 0], "^": [3, -Math.PI / 2] };

// A marker as Matplotlib names it: "o", "s", "D", "^", "x" and "." for a dot.
export function marker(pen, x, y, shape, { colour, size = 4, fill }) {
  const { context } = pen;
  const [left, top, radius] = [pen.x(x), pen.y(y), size * pen.pixel];
  context.lineWidth = 1.4 * pen.pixel;
  context.strokeStyle = colour;
  context.fillStyle = shape === "." ? colour : (fill ?? theme.paper());
  context.beginPath();
  if (shape === "x") {
    for (const [dx, dy] of [[1, 1], [1, -1]]) {
      context.moveTo(left - dx * radius, top - dy * radius);
      context.lineTo(left + dx * radius, top + dy * radius);
    }
  } else if (shape in CORNERS) {
    const [count, turn] = CORNERS[shape];
    for (let i = 0; i < count; i++) {
      const angle = turn + (2 * Math.PI * i) / count;
      context.lineTo(left + 1.25 * radius * Math.cos(angle), top + 1.25 * radius * Math.sin(angle));
    }
    context.closePath();
  } else context.arc(left, top, shape === "." ? 0.6 * radius : radius, 0, 2 * Math.PI);
  if (shape !== "x") context.fill();
  context.stroke();
}

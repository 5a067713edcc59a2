// A load curve: deflection above, frequencies below.
import { Chart, marker, polyline } from "chart";
import { h, save } from "dom";
import { columnsCsv } from "tables";
import * as theme from "theme";
import { largestOf, scaled, withUnit } from "units";

const UNITS = { voltage: "V", pressure: "Pa", force: "N" };

export class LoadView {
  constructor(place, store) {
    const get = (name) => store.get(`tuning/${name}`);
    this.quantity = get("quantity");
    this.unit = UNITS[this.quantity];
    this.load = get("load");
    const centre = get("centre");
    this.atCentre = centre.every(Number.isFinite);
    this.height = this.atCentre ? centre : get("largest");
    const [states, modes] = store.shape("tuning/frequency");
    const flat = get("frequency");
    this.frequency = Array.from({ length: modes }, (_, r) => Array.from({ length: states }, (_, i) => flat[i * modes + r]));
    this.label = get("names");
    this.limits = get("limits");
    this.note = h("p", { className: "reading", ariaLive: "polite" }, "Point at a state to read it.");
    place.append(h("div", { className: "controls" }, h("button", { type: "button", onclick: () => save(this.csv(store), "tuning.csv") }, "table as CSV")));
    this.above = this.chart(place, `deflection, ${this.atCentre ? "centre" : "largest"}`, [this.height], "m");
    this.below = this.chart(place, "frequency", this.frequency, "Hz");
    place.append(this.note, this.key());
  }

  chart(place, name, columns, unit) {
    const known = columns.flatMap((column) => [...column].filter(Number.isFinite));
    const [[x, xUnit], [y, yUnit]] = [scaled(largestOf(this.load), this.unit), scaled(largestOf(known), unit)];
    const stable = [...this.load.keys()].map((i) => this.frequency.every((column) => Number.isFinite(column[i])));
    const ends = (values, factor) => {
      const [low, high] = [Math.min(...values) * factor, Math.max(...values) * factor];
      const margin = 0.06 * (high - low || 1);
      return { low: low - margin, high: high + margin };
    };
    const points = columns.map((column) => [...column].map((value, i) => [this.load[i] * x, value * y]));
    return new Chart(place, {
      x: { label: `${this.quantity} (${xUnit})`, ...ends([...this.load], x) },
      y: { label: `${name} (${yUnit})`, ...ends(known, y) },
      height: 260, name,
      layers: [(pen) => {
        for (const limit of this.limits) polyline(pen, pen.view.y.map((end) => [limit * x, end]), { colour: theme.faint(), width: 1, dash: [2, 3] });
        points.forEach((line, r) => {
          const colour = theme.line(r);
          polyline(pen, line, { colour: theme.faint(), width: 1, dash: [3, 3] });
          polyline(pen, line.map(([a, b], i) => [a, stable[i] ? b : NaN]), { colour });
          for (const [a, b] of line) if (Number.isFinite(b)) marker(pen, a, b, ".", { colour, size: 3 });
        });
      }],
      find: () => points.flatMap((line) => line.map(([a, b], index) => ({ x: a, y: b, index })).filter((p) => Number.isFinite(p.y))),
      hover: (found) => { if (found) this.read(found.index); },
      pick: (found) => this.read(found.index),
    });
  }

  read(i) {
    const frequencies = this.frequency.map((column, r) => `${this.label[r]} ${Number.isFinite(column[i]) ? withUnit(column[i], "Hz", 8) : "–"}`);
    this.note.textContent = `${this.quantity} ${withUnit(this.load[i], this.unit)}: deflection ${withUnit(this.height[i], "m")}; ${frequencies.join(", ")}`;
  }

  key() {
    const line = h("p", { className: "note" });
    const write = () => {
      line.replaceChildren(...this.label.flatMap((name, r) => {
        const swatch = h("span", { className: "swatch" });
        swatch.style.background = theme.line(r);
        return [swatch, ` ${name}   `];
      }));
      if (this.limits.length) line.append(`⋮ ${this.quantity === "voltage" ? "pull-in" : "limit point"} at ${[...this.limits].map((l) => withUnit(l, this.unit)).join(", ")}`);
    };
    write();
    theme.onTheme(write);
    return line;
  }

  csv(store) {
    const columns = { [`${this.quantity} (${this.unit})`]: this.load, "centre (m)": store.get("tuning/centre"), "largest (m)": store.get("tuning/largest") };
    this.frequency.forEach((column, r) => { columns[`${this.label[r]} (Hz)`] = column; });
    return columnsCsv(columns);
  }
}

// A load curve: deflection, frequencies, and where they are known tension and cubic coefficients.
import { Chart, marker, polyline } from "chart";
import { h, save } from "dom";
import { columnsCsv } from "tables";
import * as theme from "theme";
import { commonUnit, largestOf, number, scaled, withUnit } from "units";

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
    const known = (name) => (store.has(`tuning/${name}`) ? get(name) : null);
    const columns = (flat) => flat && Array.from({ length: modes }, (_, r) => Array.from({ length: states }, (_, i) => flat[i * modes + r]));
    this.frequency = columns(get("frequency"));
    this.tension = known("tension");
    this.cubic = columns(known("cubic"));
    this.label = get("names");
    this.limits = get("limits");
    this.note = h("p", { className: "reading", ariaLive: "polite" }, "Point at a state to read it.");
    place.append(h("div", { className: "controls" }, h("button", { type: "button", onclick: () => save(this.csv(store), "tuning.csv") }, "table as CSV")));
    this.above = this.chart(place, `deflection, ${this.atCentre ? "centre" : "largest"}`, [this.height], "m");
    this.below = this.chart(place, "frequency", this.frequency, "Hz");
    if (this.tension) this.chart(place, "mean tension", [this.tension], "N/m");
    if (this.cubic) this.chart(place, "cubic coefficient", this.cubic, "N/m^3");
    place.append(this.note, this.key());
  }

  chart(place, name, columns, unit) {
    const known = columns.flatMap((column) => [...column].filter(Number.isFinite));
    const [[x, xUnit], [y, yUnit]] = [scaled(largestOf(this.load), this.unit), commonUnit(largestOf(known), unit)];
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
    const each = (columns, told) => columns.map((column, r) => `${this.label[r]} ${Number.isFinite(column[i]) ? told(column[i]) : "–"}`).join(", ");
    const parts = [`deflection ${withUnit(this.height[i], "m")}`, each(this.frequency, (f) => withUnit(f, "Hz", 8))];
    if (this.tension) parts.push(`tension ${withUnit(this.tension[i], "N/m")}`);
    if (this.cubic) parts.push(`cubic ${each(this.cubic, (b) => `${number(b, 4)} N/m^3`)}`);
    this.note.textContent = `${this.quantity} ${withUnit(this.load[i], this.unit)}: ${parts.join("; ")}`;
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
    if (this.tension) columns["tension (N/m)"] = this.tension;
    this.cubic?.forEach((column, r) => { columns[`cubic ${this.label[r]} (N/m^3)`] = column; });
    return columnsCsv(columns);
  }
}

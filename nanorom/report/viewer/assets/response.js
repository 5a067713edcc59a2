// The response: amplitude against drive frequency, levels and branches that can be switched,
// special points; a click on a point selects it.
import { Chart, marker, polyline } from "chart";
import { stretches } from "curves";
import { h, save } from "dom";
import { csv } from "tables";
import * as theme from "theme";
import { largestOf, number, scaled, withUnit } from "units";

const TAKES_PART = 1e-3; // of the largest amplitude; modes below have no curve of their own
const UNSTABLE = [3, 2];
const OVER = 1.08; // of the largest value: top of the axis
const UNDER = -0.04;
const DECADES = 1e-4; // of the largest amplitude: bottom of a logarithmic axis
const TWO_PI = 2 * Math.PI;

export class ResponseView {
  constructor(place, response, selection) {
    Object.assign(this, { response, selection, mode: -1, log: false });
    this.curves = new Map(response.branches.map((branch) => [branch, stretches(branch, branch.located)]));
    this.hidden = new Set(); // levels
    [this.hertz, this.hertzUnit] = scaled(response.range[1], "Hz");
    this.note = h("p", { className: "reading", ariaLive: "polite" });
    place.append(this.controls());
    this.chart = new Chart(place, {
      ...this.axes(), height: 380, name: "response: arrows move along the branch, page up and down to the next",
      layers: [(pen) => this.draw(pen)],
      find: () => this.candidates(),
      hover: (found) => this.read(found),
      pick: (found) => selection.set(found.place),
      key: (event) => this.key(event),
    });
    place.append(this.note, this.switches());
    selection.listen(() => {
      this.read(null);
      this.chart.redraw();
    });
    this.read(null);
  }

  // Amplitude in m as it is drawn: of one mode, or of all.
  measure(amplitude) {
    if (this.mode >= 0) return amplitude[this.mode];
    return Math.sqrt(amplitude.reduce((sum, q) => sum + q * q, 0));
  }

  axes() {
    const { range, branches, label } = this.response;
    const top = largestOf(branches.flatMap((branch) => branch.amplitude
      .filter((_, i) => branch.omega[i] >= TWO_PI * range[0] && branch.omega[i] <= TWO_PI * range[1])
      .map((amplitude) => this.measure(amplitude)))) || 1e-12;
    [this.metre, this.metreUnit] = scaled(top, "m");
    const high = top * this.metre;
    const whose = this.mode >= 0 ? `of ${label[this.mode]}` : label.length > 1 ? "of all modes" : `of ${label[0]}`;
    return {
      x: { label: `drive frequency (${this.hertzUnit})`, low: range[0] * this.hertz, high: range[1] * this.hertz },
      y: {
        label: `amplitude ${whose} (${this.metreUnit})`, log: this.log,
        low: (this.log ? DECADES : UNDER) * high, high: (this.log ? 1.6 : OVER) * high,
      },
    };
  }

  x(omega) {
    return (omega / TWO_PI) * this.hertz;
  }

  y(amplitude) {
    return this.measure(amplitude) * this.metre;
  }

  shown(branch) {
    return branch.shown && !this.hidden.has(branch.level);
  }

  colour(level) {
    return theme.level(level, this.response.levels.length);
  }

  draw(pen) {
    const levels = this.response.levels.map((_, k) => k).reverse(); // low ones are within high ones
    for (const level of levels) {
      const own = this.response.branches.filter((branch) => branch.level === level && this.shown(branch));
      for (const branch of own) {
        for (const { points, stable } of this.curves.get(branch)) {
          const line = points.map(([omega, ...amplitude]) => [this.x(omega), this.y(amplitude)]);
          polyline(pen, line, { colour: this.colour(level), width: stable ? 1.8 : 1.2, dash: stable ? [] : UNSTABLE });
        }
      }
      this.marks(pen, level, own);
    }
    this.selected(pen);
  }

  marks(pen, level, own) {
    const colour = this.colour(level);
    for (const left of this.response.unexplored) {
      if (left.level === level && !this.hidden.has(level)) {
        marker(pen, this.x(left.omega), this.log ? pen.view.y[0] : 0, "x", { colour, size: 3.5 });
      }
    }
    for (const branch of own) {
      for (const point of branch.located) {
        const shape = this.response.kinds[point.type][1];
        marker(pen, this.x(point.omega), this.y(point.amplitude), shape, { colour, size: 3.6 });
      }
    }
  }

  selected(pen) {
    const { place } = this.selection;
    if (!place) return;
    const seen = this.response.look(place);
    if (!this.shown(seen.branch)) return;
    const colour = this.colour(seen.branch.level);
    seen.branch.omega.forEach((omega, i) => {
      marker(pen, this.x(omega), this.y(seen.branch.amplitude[i]), ".", { colour, size: 2.4 });
    });
    marker(pen, this.x(seen.omega), this.y(seen.amplitude), "o", { colour: theme.text(), size: 6, fill: "transparent" });
  }

  candidates() {
    const { branches } = this.response;
    return branches.filter((branch) => this.shown(branch)).flatMap((branch) => [
      ...branch.omega.map((omega, index) => ({
        x: this.x(omega), y: this.y(branch.amplitude[index]), place: { branch, index },
      })),
      ...branch.located.map((special) => ({
        x: this.x(special.omega), y: this.y(special.amplitude), weight: 0.5, place: { special, index: special.index },
      })),
    ]);
  }

  // Says what is below the pointer, or selected.
  read(found) {
    const place = found?.place ?? this.selection.place;
    this.note.textContent = place ? this.describe(this.response.look(place)) : "Click a point of a curve: its motion is shown.";
  }

  describe({ special, branch, level, omega, amplitude, stable }) {
    const kind = special ? `${this.response.kinds[special.type][0]} (${special.type})` : stable ? "stable" : "unstable";
    return `${level.name}, branch ${branch.number}, ${kind}: ${withUnit(omega / TWO_PI, "Hz", 9)}, ${withUnit(this.measure(amplitude), "m")}`;
  }

  key(event) {
    const { place } = this.selection;
    const open = this.response.branches.filter((branch) => this.shown(branch));
    if (!open.length) return false;
    const steps = { ArrowRight: 1, ArrowLeft: -1, ArrowUp: 1, ArrowDown: -1, PageDown: 1, PageUp: -1 };
    if (!(event.key in steps)) return false;
    const branch = place ? (place.special ? this.response.branchOf(place.special) : place.branch) : open[0];
    if (event.key.startsWith("Page") || !place) {
      const next = open[(open.indexOf(branch) + (place ? steps[event.key] : 0) + open.length) % open.length];
      this.selection.set({ branch: next, index: 0 });
      return true;
    }
    const from = place.special ? this.after(branch, place.special) : place.index;
    const index = Math.min(Math.max(from + steps[event.key], 0), branch.omega.length - 1);
    this.selection.set({ branch, index });
    return true;
  }

  // Number of the point of a branch that is nearest to a special point.
  after(branch, special) {
    const away = branch.omega.map((omega, i) => Math.abs(omega / special.omega - 1)
      + Math.abs(this.measure(branch.amplitude[i]) / this.measure(special.amplitude) - 1));
    return away.indexOf(Math.min(...away));
  }

  controls() {
    const { branches, label, size } = this.response;
    const tops = Array.from({ length: size }, (_, r) => largestOf(branches.flatMap((b) => b.amplitude.map((q) => q[r]))));
    const part = label.map((_, r) => r).filter((r) => tops[r] >= TAKES_PART * Math.max(...tops));
    const select = h("select", { onchange: () => this.remeasure(Number(select.value), this.log) },
      h("option", { value: -1 }, "all modes"), ...part.map((r) => h("option", { value: r }, label[r])));
    const log = h("input", { type: "checkbox", onchange: () => this.remeasure(this.mode, log.checked) });
    return h("div", { className: "controls" },
      h("label", {}, "amplitude of ", select),
      h("label", {}, log, " logarithmic"),
      h("button", { type: "button", onclick: () => save(csv(this.response), "response.csv") }, "table as CSV"));
  }

  remeasure(mode, log) {
    Object.assign(this, { mode, log });
    this.chart.reset(this.axes());
    this.read(null);
  }

  // Levels and their branches, each to be switched, with what line styles and markers mean.
  switches() {
    const { levels, branches, kinds, points } = this.response;
    const box = (checked, change, ...content) => {
      const input = h("input", { type: "checkbox", checked, onchange: () => {
        change(input.checked);
        this.chart.redraw();
      } });
      return h("label", {}, input, " ", ...content);
    };
    const rows = levels.map((level, k) => {
      const swatch = h("span", { className: "swatch" });
      const paint = () => { swatch.style.background = this.colour(k); };
      paint();
      theme.onTheme(paint);
      const own = branches.filter((branch) => branch.level === k);
      const inner = own.map((branch) => box(true, (on) => { branch.shown = on; }, named(branch)));
      return h("details", {}, h("summary", {}, box(true, (on) => {
        if (on) this.hidden.delete(k);
        else this.hidden.add(k);
      }, swatch, " ", level.name), ` · ${own.length} ${own.length > 1 ? "branches" : "branch"}`), h("div", { className: "branches" }, ...inner));
    });
    const signs = { s: "□", D: "◇", o: "○", "^": "△" };
    const found = Object.entries(kinds).filter(([code]) => points.some((point) => point.type === code));
    const key = ["— stable", "- - unstable", ...found.map(([, [name, sign]]) => `${signs[sign]} ${name}`),
      ...(this.response.unexplored.length ? ["× not explored"] : [])].join("   ");
    return h("div", { className: "switches" }, h("p", { className: "note" }, key), ...rows);
  }
}

function named(branch) {
  const period = branch.multiple > 1 ? `, ${branch.multiple} periods of the drive` : "";
  const from = branch.parent === null ? "" : `, from branch ${branch.parent}`;
  return `branch ${branch.number}: ${number(branch.omega.length)} points${period}${from}`;
}

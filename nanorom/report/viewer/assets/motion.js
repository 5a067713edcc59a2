// The motion at the selected point: the film, amplitudes over time, spectrum, energies, stability.
import { facts, h } from "dom";
import { FilmView, heading } from "film";
import { modeTable, multiplierPicture, SpectrumChart, TimeChart } from "spectrum";
import * as theme from "theme";
import { number, withUnit } from "units";

const TAKES_PART = 1e-4; // of the largest amplitude; modes below are not drawn
const TWO_PI = 2 * Math.PI;

export class MotionView {
  constructor(places, response, selection, store, film) {
    Object.assign(this, { response, store, film });
    this.mass = store.has("rom/mass") ? store.get("rom/mass") : null;
    this.facts = h("div");
    this.circle = h("figure");
    this.modes = h("div", { className: "wide sum" });
    places.beside.append(this.facts);
    const [time, lines] = [h("figure"), h("figure")];
    places.below.append(time, lines, this.circle, this.modes);
    this.time = new TimeChart(time);
    this.spectrum = new SpectrumChart(lines);
    time.append(h("figcaption", {}, "Amplitudes over a period of the motion"));
    lines.append(h("figcaption", {}, "Spectrum"));
    film?.listeners.push((theta) => this.time.at(theta / TWO_PI));
    selection.listen((place) => this.show(response.look(place)));
    theme.onTheme(() => this.seen && this.table());
  }

  show(seen) {
    this.seen = seen;
    const { orbit, multipliers } = seen;
    const series = orbit.series();
    const tops = seen.amplitude;
    const most = Math.max(...tops);
    this.part = [...tops.keys()].filter((r) => tops[r] >= TAKES_PART * most);
    this.shares = this.mass ? orbit.shares(this.mass) : null;
    this.facts.replaceChildren(this.described(seen));
    this.time.show(series, this.part);
    this.spectrum.show(orbit, this.part);
    this.circle.replaceChildren(multiplierPicture(multipliers), h("figcaption", {}, "Floquet multipliers on the unit circle"));
    this.table();
    this.film?.show({
      at: (theta) => orbit.at(theta), samples: series, period: orbit.period, unit: "m",
      title: `${seen.level.name}, driven at ${heading(orbit)}`,
    });
  }

  table() {
    this.modes.replaceChildren(modeTable(this.part.map((r, i) => ({
      colour: theme.line(i),
      label: this.response.label[r],
      amplitude: withUnit(this.seen.amplitude[r], "m", 6),
      share: this.shares ? this.shares[r] : null,
    }))));
  }

  described({ special, branch, level, omega, stable, multiple, multipliers, orbit, own, place }) {
    const { ending } = branch;
    const kind = special ? `${this.response.kinds[special.type][0]} (${special.type})` : stable ? "stable" : "unstable";
    const largest = Math.max(...multipliers.map(([a, b]) => Math.hypot(a, b)));
    const rows = [
      ["drive level", level.name],
      ["branch", `${branch.number}${special ? "" : `, point ${place.index + 1} of ${branch.omega.length}`}`],
      ["this point", kind],
      ["drive frequency", withUnit(omega / TWO_PI, "Hz", 10)],
      ["period", multiple > 1 ? `${multiple} periods of the drive` : "that of the drive"],
      ["largest multiplier", number(largest, 6)],
    ];
    if (ending) rows.push(["the branch ends", ending]);
    if (!own) rows.push(["motion", `of the nearest point that the page holds, at ${withUnit(orbit.omega / TWO_PI, "Hz", 8)}`]);
    return facts(rows);
  }
}

export { FilmView };

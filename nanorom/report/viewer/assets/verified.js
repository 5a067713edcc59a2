// Orbits of the model beside those of the film: amplitudes above, errors below.
import { Chart, marker, polyline } from "chart";
import { h } from "dom";
import * as theme from "theme";
import { largestOf, number, scaled, withUnit } from "units";

const LEAST = 1e-9; // error below which a logarithmic axis shows none
const TWO_PI = 2 * Math.PI;

export class VerifiedView {
  constructor(place, store) {
    const get = (name) => store.get(`verified/${name}`);
    const label = get("label");
    const size = label.length;
    const [modal, full] = [get("modal"), get("full")];
    const levels = [...new Set(get("level"))];
    this.rows = Array.from(get("omega"), (omega, i) => {
      const own = modal.subarray(i * size, (i + 1) * size);
      const mode = own.indexOf(Math.max(...own));
      return {
        level: levels.indexOf(get("level")[i]), number: get("level")[i], branch: get("branch")[i], type: get("type")[i],
        omega, omegaFull: get("omega_full")[i], mode: label[mode],
        modal: own[mode], full: full[i * size + mode],
        estimate: get("estimate")[i], error: Math.abs(get("error")[i]), residual: get("residual")[i],
      };
    });
    this.count = levels.length;
    [this.hertz, this.hertzUnit] = scaled(largestOf(this.rows.map((row) => row.omega / TWO_PI)), "Hz");
    this.note = h("p", { className: "reading", ariaLive: "polite" }, "Point at an orbit to read it.");
    this.make(place);
    place.append(this.note, h("p", { className: "note" }, "● model (below: its estimated error)   ○ film (below: the true error)"));
  }

  x(omega) {
    return (omega / TWO_PI) * this.hertz;
  }

  make(place) {
    const xs = this.rows.flatMap((row) => [row.omega, row.omegaFull]).filter(Number.isFinite).map((omega) => this.x(omega));
    const [low, high] = [Math.min(...xs), Math.max(...xs)];
    const margin = 0.04 * (high - low || 1);
    const x = { label: `drive frequency (${this.hertzUnit})`, low: low - margin, high: high + margin };
    const top = largestOf(this.rows.flatMap((row) => [row.modal, row.full].filter(Number.isFinite)));
    const [metre, metreUnit] = scaled(top, "m");
    const errors = this.rows.flatMap((row) => [row.error, row.estimate]).filter((e) => Number.isFinite(e) && e > 0);
    const [least, most] = errors.length ? [Math.max(LEAST, Math.min(...errors)), Math.max(...errors)] : [LEAST, 1];
    this.chart(place, "amplitudes", { x, y: { label: `largest mode (${metreUnit})`, low: -0.04 * top * metre, high: 1.08 * top * metre } },
      (row) => row.modal * metre, (row) => row.full * metre);
    this.chart(place, "relative errors", { x, y: { label: "relative error", low: least / 2, high: most * 2, log: true } },
      (row) => Math.max(row.estimate, LEAST), (row) => Math.max(row.error, LEAST));
  }

  chart(place, name, axes, ofModel, ofFilm) {
    const colour = (row) => theme.level(row.level, this.count);
    const regular = this.rows.filter((row) => row.type === "-");
    const names = [...new Set(regular.map((row) => `${row.level} ${row.branch}`))];
    const lines = names.map((own) => regular.filter((row) => `${row.level} ${row.branch}` === own));
    const points = this.rows.flatMap((row) => [
      { x: this.x(row.omega), y: ofModel(row), row, film: false },
      { x: this.x(row.omegaFull), y: ofFilm(row), row, film: true },
    ]).filter((point) => Number.isFinite(point.x) && Number.isFinite(point.y));
    new Chart(place, {
      ...axes, height: 260, name,
      layers: [(pen) => {
        for (const line of lines) polyline(pen, line.map((row) => [this.x(row.omega), ofModel(row)]), { colour: colour(line[0]), width: 1 });
        for (const { x, y, row, film } of points) marker(pen, x, y, film ? "o" : ".", { colour: colour(row), size: film ? 4.5 : 3.5, fill: "transparent" });
      }],
      find: () => points,
      hover: (found) => { if (found) this.read(found.row); },
      pick: (found) => this.read(found.row),
    });
  }

  read(row) {
    this.note.textContent = `level ${row.number + 1}, branch ${row.branch}${row.type === "-" ? "" : `, ${row.type}`}, ${withUnit(row.omega / TWO_PI, "Hz", 8)}: `
      + `${row.mode} ${withUnit(row.modal, "m")} in the model, ${Number.isFinite(row.full) ? withUnit(row.full, "m") : "–"} in the film; `
      + `estimate ${number(row.estimate, 3)}, error ${number(row.error, 3)}, residual ${number(row.residual, 2)}`;
  }
}

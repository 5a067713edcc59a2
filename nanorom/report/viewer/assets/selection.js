// Branches, special points and orbits of a response, and which of them is looked at.
import { Orbit } from "orbit";

export class Response {
  constructor(store) {
    this.store = store;
    this.levels = store.get("response/levels");
    this.label = store.get("response/label");
    this.size = this.label.length;
    this.range = store.get("response/range");
    this.kinds = store.get("response/kinds");
    this.branches = this.levels.flatMap((level, k) =>
      Array.from({ length: level.branches }, (_, b) => this.branch(k, b)));
    this.points = this.levels.flatMap((_, k) => this.specialPoints(k));
    this.unexplored = this.levels.flatMap((_, k) => this.missing(k));
    for (const branch of this.branches) {
      branch.located = this.points.filter((p) => p.level === branch.level && p.branch === branch.number);
    }
  }

  rows(path, count) {
    const flat = this.store.get(path);
    return Array.from({ length: count }, (_, i) => flat.subarray(i * this.size, (i + 1) * this.size));
  }

  branch(level, number) {
    const at = `response/level/${level}/branch/${number}`;
    const get = (name) => this.store.get(`${at}/${name}`);
    const omega = Array.from(get("omega"));
    return {
      level, number, at, omega,
      amplitude: this.rows(`${at}/amplitude`, omega.length),
      stable: get("stable"),
      multiple: get("period_multiple"),
      parent: get("parent"),
      ending: get("ending"),
      family: get("family"),
      shown: true,
    };
  }

  specialPoints(level) {
    const at = `response/level/${level}/special_points`;
    const get = (name) => this.store.get(`${at}/${name}`);
    const amplitude = this.rows(`${at}/amplitude`, get("omega").length);
    return Array.from(get("omega"), (omega, index) => ({
      level, index, at, omega,
      type: get("type")[index],
      branch: get("branch")[index],
      multiple: get("period_multiple")[index],
      amplitude: amplitude[index],
    }));
  }

  missing(level) {
    const get = (name) => this.store.get(`response/level/${level}/unexplored/${name}`);
    return Array.from(get("omega"), (omega, i) => ({ level, omega, kind: get("kind")[i], why: get("why")[i] }));
  }

  branchOf({ level, branch }) {
    return this.branches.find((other) => other.level === level && other.number === branch);
  }

  // What is known of a special point, or of a point of a branch: {branch object, index} there.
  look(place) {
    const { special, branch, index } = place;
    const of = special ?? branch;
    const kept = special ? index : nearest(this.store.get(`${branch.at}/kept`), index);
    return {
      place, special, branch: special ? this.branchOf(special) : branch,
      level: this.levels[of.level],
      omega: special ? special.omega : branch.omega[index],
      amplitude: special ? special.amplitude : branch.amplitude[index],
      stable: special ? null : Boolean(branch.stable[index]),
      multiple: of.multiple,
      orbit: this.orbit(of, kept),
      multipliers: this.multipliers(of.at, kept),
      own: special ? true : this.store.get(`${branch.at}/kept`)[kept] === index,
    };
  }

  orbit(of, row) {
    const rows = this.store.get(`${of.at}/rows`);
    let start = 0;
    for (let i = 0; i < row; i++) start += rows[i];
    const all = this.store.get(`${of.at}/coefficients`);
    const own = all.subarray(start * this.size, (start + rows[row]) * this.size);
    const place = this.store.has(`${of.at}/kept`) ? this.store.get(`${of.at}/kept`)[row] : row;
    const omega = "type" in of ? of.omega : of.omega[place];
    return new Orbit(own, this.size, omega, of.multiple);
  }

  multipliers(at, row) {
    const all = this.store.get(`${at}/multipliers`);
    return Array.from({ length: 2 * this.size }, (_, i) => {
      const place = 2 * (row * 2 * this.size + i);
      return [all[place], all[place + 1]];
    });
  }
}

// Number of the entry of a rising array that is nearest to a value.
function nearest(rising, value) {
  let best = 0;
  for (let i = 1; i < rising.length; i++) {
    if (Math.abs(rising[i] - value) < Math.abs(rising[best] - value)) best = i;
  }
  return best;
}

// What is selected; who listens is told of every change.
export class Selection {
  constructor() {
    this.place = null;
    this.listeners = [];
  }

  listen(tell) {
    this.listeners.push(tell);
  }

  set(place) {
    this.place = place;
    this.listeners.forEach((tell) => tell(place));
  }
}

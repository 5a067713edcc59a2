// The results of a page by the paths that they have in their files.
const TYPES = {
  f8: Float64Array, f4: Float32Array, i4: Int32Array, u4: Uint32Array,
  i2: Int16Array, u2: Uint16Array, u1: Uint8Array,
};

export class Store {
  // table: what is where, by path; data: an ArrayBuffer with all numbers
  constructor(table, data) {
    this.table = table;
    this.data = data;
    this.made = new Map();
  }

  has(path) {
    return path in this.table;
  }

  // An array of numbers, row by row, or whatever else is at a path.
  get(path) {
    const entry = this.table[path];
    if (entry === undefined) throw new Error(`the page has nothing at ${path}`);
    if ("value" in entry) return entry.value;
    if (!this.made.has(path)) {
      const length = entry.shape.reduce((product, n) => product * n, 1);
      let array = new TYPES[entry.type](this.data, entry.at, length);
      if (entry.scale) array = Float32Array.from(array, (x) => x * entry.scale);
      this.made.set(path, array);
    }
    return this.made.get(path);
  }

  shape(path) {
    return this.table[path].shape;
  }
}

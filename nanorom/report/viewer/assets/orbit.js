// A periodic orbit from its Fourier coefficients, as nanorom's PeriodicOrbit.
const INSTANTS = 256; // per period, as in nanorom.rom.motion

export class Orbit {
  // coefficients: 1, cos, sin, cos 2, ... of L modes each; omega in rad/s of the drive
  constructor(coefficients, modes, omega, multiple) {
    this.coefficients = coefficients;
    this.modes = modes;
    this.omega = omega;
    this.multiple = multiple;
    this.harmonics = (coefficients.length / modes - 1) / 2;
  }

  get period() {
    return (2 * Math.PI * this.multiple) / this.omega;
  }

  // q (L) in m at a phase theta = omega t / multiple, from 0 to 2 pi
  at(theta) {
    const q = Float64Array.from(this.coefficients.subarray(0, this.modes));
    for (let k = 1; k <= this.harmonics; k++) {
      const [cosine, sine] = [Math.cos(k * theta), Math.sin(k * theta)];
      const row = (2 * k - 1) * this.modes;
      for (let r = 0; r < this.modes; r++) {
        q[r] += this.coefficients[row + r] * cosine + this.coefficients[row + this.modes + r] * sine;
      }
    }
    return q;
  }

  // q over one period: INSTANTS + 1 of them, the last as the first
  series() {
    return Array.from({ length: INSTANTS + 1 }, (_, i) => this.at((2 * Math.PI * i) / INSTANTS));
  }

  // |a_k| of mode r, k = 0 ... harmonics
  lines(r) {
    const sizes = [Math.abs(this.coefficients[r])];
    for (let k = 1; k <= this.harmonics; k++) {
      const row = (2 * k - 1) * this.modes + r;
      sizes.push(Math.hypot(this.coefficients[row], this.coefficients[row + this.modes]));
    }
    return sizes;
  }

  // Share of each mode in the kinetic energy, mean over a period
  shares(mass) {
    const energy = Array.from({ length: this.modes }, (_, r) =>
      mass[r] * this.lines(r).reduce((sum, size, k) => sum + (k * size) ** 2, 0));
    const total = energy.reduce((sum, value) => sum + value, 0);
    return energy.map((value) => (total > 0 ? value / total : 0));
  }
}

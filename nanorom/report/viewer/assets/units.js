// Values with prefixed units, as nanorom.scene.units has them.
const PREFIXES = { "-15": "f", "-12": "p", "-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T" };

// Factor and prefixed unit in which the largest of the values is 1 ... 1000.
export function scaled(largest, unit) {
  const size = Math.abs(largest);
  if (!Number.isFinite(size) || size === 0) return [1, unit];
  const power = Math.min(12, Math.max(-15, 3 * Math.floor(Math.log10(size) / 3 + 1e-9)));
  return [10 ** -power, PREFIXES[power] + unit];
}

// As scaled; units that take no prefix, as N/m^3 does not, get a power of ten.
export function commonUnit(largest, unit) {
  if (!unit.includes("^")) return scaled(largest, unit);
  const power = largest ? 3 * Math.floor(Math.log10(Math.abs(largest)) / 3 + 1e-9) : 0;
  return [10 ** -power, power ? `1e${power} ${unit}` : unit];
}

export function withUnit(value, unit, digits = 6) {
  const [factor, name] = scaled(value, unit);
  return `${number(value * factor, digits)} ${name}`;
}

// Significant digits without zeros at the end; powers of ten where it is very large or small.
export function number(value, digits = 6, large = 1e9, small = 1e-4) {
  if (!Number.isFinite(value)) return "–";
  if (value !== 0 && (Math.abs(value) < small || Math.abs(value) >= large)) {
    const [mantissa, power] = value.toExponential(digits - 1).split("e");
    return `${Number(mantissa)}e${Number(power)}`.replaceAll("-", "−");
  }
  return String(Number(value.toPrecision(digits))).replace("-", "−");
}

export function largestOf(values) {
  let largest = 0;
  for (const value of values) if (Math.abs(value) > largest) largest = Math.abs(value);
  return largest;
}

// How branches are drawn: as nanorom.plots.curves does, stretches of equal stability, smooth
// between the computed points by Akima's interpolation along the curve.
const FINER = 8; // straight pieces per continuation step
const SHORTEST = 1e-9; // of the picture; keeps points apart that coincide
const APART = 1e-5; // of a branch; special points closer to one of its points are not told apart
const FEWEST = 5; // points that a smooth curve needs
const FLAT = 1e-9; // of the largest bend, below which Akima's weights are equal

// branch: {omega (n), amplitude (n rows of L), stable (n)}; located: special points on it,
// {omega, amplitude (L)}. Stretches {omega, amplitude, stable}; the unstable side closes the gap.
export function stretches(branch, located) {
  const points = branch.omega.map((omega, i) => [omega, ...branch.amplitude[i]]);
  const stable = [...branch.stable].map(Boolean);
  const sizes = extent(points);
  if (sizes) for (const point of located) insert(points, stable, sizes, point);
  const [fine, step] = smooth(points, sizes);
  const ends = [0];
  for (let i = 1; i < stable.length; i++) if (stable[i] !== stable[i - 1]) ends.push(i);
  ends.push(stable.length);
  return ends.slice(0, -1).map((start, k) => {
    const stop = ends[k + 1];
    const first = stable[start] ? start : Math.max(start - 1, 0);
    const last = stable[start] ? stop - 1 : Math.min(stop, stable.length - 1);
    return { points: fine.slice(first * step, last * step + 1), stable: stable[start] };
  });
}

// Width and height of a branch: what distances on it are measured by.
function extent(points) {
  let [low, high, top] = [Infinity, -Infinity, 0];
  for (const [omega, ...amplitude] of points) {
    low = Math.min(low, omega);
    high = Math.max(high, omega);
    top = Math.max(top, ...amplitude);
  }
  return high > low && top > 0 ? [high - low, top] : null;
}

function distance(one, two, [width, height]) {
  let sum = 0;
  for (let i = 0; i < one.length; i++) sum += ((one[i] - two[i]) / (i ? height : width)) ** 2;
  return Math.sqrt(sum);
}

function insert(points, stable, sizes, { omega, amplitude }) {
  const own = [omega, ...amplitude];
  const away = points.map((point) => distance(point, own, sizes));
  let [after, least] = [1, Infinity];
  for (let i = 1; i < points.length; i++) {
    const detour = away[i - 1] + away[i] - distance(points[i], points[i - 1], sizes);
    if (detour < least) [after, least] = [i, detour];
  }
  if (Math.min(away[after - 1], away[after]) > APART) {
    points.splice(after, 0, own);
    stable.splice(after, 0, stable[after - 1] || stable[after]);
  }
}

// A finer curve through the points, and how many of its pieces make one step.
function smooth(points, sizes) {
  if (points.length < FEWEST || !sizes) return [points, 1];
  const length = [0];
  for (let i = 1; i < points.length; i++) {
    length.push(length[i - 1] + distance(points[i], points[i - 1], sizes) + SHORTEST);
  }
  const slopes = akimaSlopes(length, points);
  const fine = [];
  for (let i = 0; i + 1 < points.length; i++) {
    const step = length[i + 1] - length[i];
    for (let k = 0; k < FINER; k++) fine.push(hermite(points, slopes, i, k / FINER, step));
  }
  fine.push(points[points.length - 1]);
  return [fine, FINER];
}

function hermite(points, slopes, i, t, step) {
  const a = (1 + 2 * t) * (1 - t) ** 2;
  const b = t * (1 - t) ** 2 * step;
  const c = t * t * (3 - 2 * t);
  const d = t * t * (t - 1) * step;
  return points[i].map((left, r) => {
    const value = a * left + b * slopes[i][r] + c * points[i + 1][r] + d * slopes[i + 1][r];
    return r ? Math.max(value, 0) : value;
  });
}

// Akima 1970, doi:10.1145/321607.321609.
function akimaSlopes(x, y) {
  const [n, size] = [x.length, y[0].length];
  const m = Array.from({ length: n + 3 }, () => new Float64Array(size));
  for (let r = 0; r < size; r++) {
    for (let i = 0; i + 1 < n; i++) m[i + 2][r] = (y[i + 1][r] - y[i][r]) / (x[i + 1] - x[i]);
    m[1][r] = 2 * m[2][r] - m[3][r];
    m[0][r] = 2 * m[1][r] - m[2][r];
    m[n + 1][r] = 2 * m[n][r] - m[n - 1][r];
    m[n + 2][r] = 2 * m[n + 1][r] - m[n][r];
  }
  const bend = (i, r) => Math.abs(m[i + 1][r] - m[i][r]);
  let most = 0;
  for (let i = 0; i < n; i++) {
    for (let r = 0; r < size; r++) most = Math.max(most, bend(i + 2, r) + bend(i, r));
  }
  return x.map((_, i) => Array.from({ length: size }, (_, r) => {
    const [after, before] = [bend(i + 2, r), bend(i, r)];
    if (after + before <= FLAT * most) return (m[i + 3][r] + m[i][r]) / 2;
    return (after * m[i + 1][r] + before * m[i + 2][r]) / (after + before);
  }));
}

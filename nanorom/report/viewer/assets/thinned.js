// Fewer triangles for the same film: what is finer than a picture shows costs time without a graphics card.
const PASSES = 12; // each takes away at most one of three points; nothing is left to take long before
const LONGEST = 2.2; // edges that are made, in units of the length below which edges go
const FLATTEST = 0.08; // twice the area by the square of the longest edge of triangles that are made

// places: x, y, z of every point; cells: triangles, all in one sense of rotation, seen from above;
// fixed: points that stay, the outline among them; least: length below which edges go.
// Triangles of a part of the points: points within are drawn into a neighbour, one after another.
export function thinned(places, cells, fixed, least) {
  let kept = cells;
  for (let pass = 0; pass < PASSES; pass++) {
    const fewer = thinnedOnce(places, kept, fixed, least);
    if (fewer.length === kept.length) break;
    kept = fewer;
  }
  return kept;
}

function thinnedOnce(places, cells, fixed, least) {
  const result = Uint32Array.from(cells);
  const { star, of } = starsOf(cells, fixed.length);
  const busy = Uint8Array.from(fixed);
  for (let v = 0; v < fixed.length; v++) {
    if (busy[v] || star[v] === star[v + 1]) continue;
    const around = of.subarray(star[v], star[v + 1]);
    const ring = Array.from(around, (k) => [cells[next(k)], cells[next(next(k))]]);
    const target = best(places, v, ring, least);
    if (target === null) continue;
    for (const k of around) result[k] = target;
    for (const [a] of ring) busy[a] = 1; // their own stars have changed
  }
  return whole(result);
}

const next = (k) => (k % 3 === 2 ? k - 2 : k + 1); // corner of the same triangle

// Of every point the corners of triangles at which it stands: of[star[v]] ... of[star[v + 1] - 1]
function starsOf(cells, count) {
  const star = new Uint32Array(count + 2);
  for (const v of cells) star[v + 2] += 1;
  for (let v = 0; v < count; v++) star[v + 2] += star[v + 1];
  const of = new Uint32Array(cells.length);
  cells.forEach((v, k) => { of[star[v + 1]++] = k; });
  return { star, of };
}

// The point of a ring [from, to] about v into which v is best drawn: its edges give the ring the best
// triangles; none if no edge of v is short, or no triangles are good
function best(places, v, ring, least) {
  if (!ring.some(([a]) => squared(places, v, a) < least ** 2)) return null;
  const longest = (LONGEST * least) ** 2;
  let [found, most] = [null, FLATTEST];
  for (const [target] of ring) {
    let worst = Infinity;
    for (const [a, b] of ring) {
      if (a === target || b === target) continue;
      worst = Math.min(worst, quality(places, target, a, b, longest));
      if (worst <= most) break;
    }
    if (worst > most && worst < Infinity) [found, most] = [target, worst];
  }
  return found;
}

// Twice the area by the square of the longest edge; below zero if turned over or too long
function quality(p, i, j, k, longest) {
  const most = Math.max(squared(p, i, j), squared(p, j, k), squared(p, k, i));
  if (most > longest) return -1;
  const x = p[3 * i], y = p[3 * i + 1];
  return ((p[3 * j] - x) * (p[3 * k + 1] - y) - (p[3 * j + 1] - y) * (p[3 * k] - x)) / most;
}

const squared = (p, i, j) => (p[3 * j] - p[3 * i]) ** 2 + (p[3 * j + 1] - p[3 * i + 1]) ** 2;

// Without triangles of which two corners have become one
function whole(cells) {
  const kept = [];
  for (let c = 0; c < cells.length; c += 3) {
    const [i, j, k] = cells.subarray(c, c + 3);
    if (i !== j && j !== k && k !== i) kept.push(i, j, k);
  }
  return Uint32Array.from(kept);
}

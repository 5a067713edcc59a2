// The film as a surface that moves: a mesh whose heights and colours are set for every picture.
import {
  BufferAttribute, BufferGeometry, Color, DoubleSide, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial,
  PerspectiveCamera, Scene, WebGLRenderer,
} from "three";
import { diverging, isDark } from "theme";
import { thinned } from "thinned";

const FLATTEST = 1 / 8; // a narrower film is drawn wider than it is, and the page says so
const FINEST = 1 / 72; // of the film's size: edges that are shorter show no more than longer ones
const COLOURS = Array.from({ length: 256 }, (_, i) =>
  new Color().setRGB(...diverging((2 * i) / 255 - 1), "srgb"));
const LAMP = [-0.41, -0.41, 0.815]; // direction of the light
const [SHADE, SHINE] = [0.45, 0.62]; // brightness of what is turned away from it, and what it adds
const VIEW = 26; // degrees of the camera

export class Film {
  // From a store: places, triangles and shapes; rest: heights at rest in m
  constructor(store) {
    this.points = store.get("rom/shapes/points");
    this.cells = oriented(this.points, store.get("rom/shapes/cells"));
    this.shapes = store.get("rom/shapes/values");
    [this.modes, this.count] = store.shape("rom/shapes/values");
    this.rest = store.has("rom/static/deflection") ? store.get("rom/static/deflection") : null;
    const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    for (let i = 0; i < this.count; i++) {
      for (const side of [0, 1]) {
        low[side] = Math.min(low[side], this.points[3 * i + side]);
        high[side] = Math.max(high[side], this.points[3 * i + side]);
      }
    }
    this.middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
    const sides = [high[0] - low[0], high[1] - low[1]];
    const short = sides[0] < sides[1] ? 0 : 1;
    this.size = Math.max(...sides);
    this.stretch = [1, 1];
    this.stretch[short] = Math.max(1, (FLATTEST * this.size) / sides[short]);
    this.edges = outline(this.cells);
    this.places = new Float32Array(3 * this.count);
    for (let i = 0; i < this.count; i++) this.places.set(this.place(i), 3 * i);
    const fixed = new Uint8Array(this.count);
    for (const i of this.edges) fixed[i] = 1;
    this.drawn = thinned(this.places, this.cells, fixed, FINEST);
  }

  // sum_r q_r phi_r (P) of amplitudes q (of as many modes as have shapes), into `out`
  deflection(q, out = new Float32Array(this.count)) {
    out.fill(0);
    for (let r = 0; r < this.modes; r++) {
      if (q[r] === 0) continue;
      const start = r * this.count;
      for (let i = 0; i < this.count; i++) out[i] += q[r] * this.shapes[start + i];
    }
    return out;
  }

  // Place of a point at rest, for a film of size 1 about the origin.
  place(i) {
    const height = this.points[3 * i + 2] + (this.rest ? this.rest[i] : 0);
    const [x, y] = [0, 1].map((s) => ((this.points[3 * i + s] - this.middle[s]) * this.stretch[s]) / this.size);
    return [x, y, height / this.size];
  }
}

// Triangles with their points in one sense of rotation, seen from above: files leave it open.
function oriented(points, cells) {
  const turned = Uint32Array.from(cells);
  const side = (a, b, s) => points[3 * b + s] - points[3 * a + s];
  for (let c = 0; c < turned.length; c += 3) {
    const [i, j, k] = turned.subarray(c, c + 3);
    if (side(i, j, 0) * side(i, k, 1) < side(i, j, 1) * side(i, k, 0)) turned.set([j, i], c);
  }
  return turned;
}

// Pairs of points of the edges that belong to one triangle only.
function outline(cells) {
  const seen = new Map();
  for (let c = 0; c < cells.length; c += 3) {
    for (let k = 0; k < 3; k++) {
      const [a, b] = [cells[c + k], cells[c + ((k + 1) % 3)]];
      const name = a < b ? `${a} ${b}` : `${b} ${a}`;
      seen.set(name, seen.has(name) ? null : [a, b]);
    }
  }
  return [...seen.values()].filter(Boolean).flat();
}

// A scene with the film in it, drawn into a canvas.
export class Stage {
  constructor(film, canvas) {
    this.film = film;
    this.renderer = new WebGLRenderer({ canvas, antialias: false, alpha: true, preserveDrawingBuffer: true });
    this.base = film.places;
    this.places = this.base.slice();
    this.geometry = new BufferGeometry();
    this.geometry.setAttribute("position", new BufferAttribute(this.places, 3));
    this.colours = new Float32Array(3 * film.count);
    this.geometry.setAttribute("color", new BufferAttribute(this.colours, 3));
    this.geometry.setIndex(new BufferAttribute(film.drawn, 1));
    this.scene = new Scene();
    // light is part of the colours: without a graphics card that is several times faster
    this.scene.add(new Mesh(this.geometry, new MeshBasicMaterial({ vertexColors: true, side: DoubleSide })));
    this.normals = new Float32Array(3 * film.count);
    const rim = new BufferGeometry(); // of the film's own points: where an edge is free, it moves with them
    rim.setAttribute("position", this.geometry.attributes.position);
    rim.setIndex(film.edges);
    this.rim = new LineSegments(rim, new LineBasicMaterial());
    this.scene.add(this.rim);
    this.camera = new PerspectiveCamera(VIEW, 1, 0.1, 20);
    this.camera.up.set(0, 0, 1);
    this.turn(-0.5 * Math.PI - 0.5, 0.6, 1);
  }

  // Direction to look from (radians) and how near
  turn(azimuth, elevation, near) {
    Object.assign(this, { azimuth, near, elevation: Math.min(Math.max(elevation, -1.55), 1.55) });
    const away = 2.2 / near;
    this.camera.position.set(
      away * Math.cos(this.elevation) * Math.cos(azimuth),
      away * Math.cos(this.elevation) * Math.sin(azimuth),
      away * Math.sin(this.elevation),
    );
    this.camera.lookAt(0, 0, 0);
  }

  resize(width, height, ratio) {
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.zoom = Math.min(1, this.camera.aspect / 1.25);
    this.camera.updateProjectionMatrix();
  }

  // values (P): deflections; magnified: height of a unit of them, for a film of size 1;
  // largest: the value of the strongest colour
  draw(values, magnified, largest) {
    const { places, base } = this;
    for (let i = 0; i < values.length; i++) places[3 * i + 2] = base[3 * i + 2] + magnified * values[i];
    this.paint(values, largest > 0 ? 127.5 / largest : 0);
    this.geometry.attributes.position.needsUpdate = true;
    this.geometry.attributes.color.needsUpdate = true;
    this.rim.material.color.set(isDark() ? 0x9a9a9a : 0x555555);
    this.renderer.render(this.scene, this.camera);
  }

  // Colours of the deflections, lighter where the surface faces the lamp.
  paint(values, scale) {
    const { colours } = this;
    const normals = this.facing();
    for (let i = 0; i < values.length; i++) {
      const [x, y, z] = [normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]];
      const light = SHADE + (SHINE * Math.abs(LAMP[0] * x + LAMP[1] * y + LAMP[2] * z)) / Math.hypot(x, y, z);
      const colour = COLOURS[Math.min(255, Math.max(0, Math.round(127.5 + scale * values[i])))];
      colours[3 * i] = colour.r * light;
      colours[3 * i + 1] = colour.g * light;
      colours[3 * i + 2] = colour.b * light;
    }
  }

  // Normals of the surface at its points, of no particular length.
  facing() {
    const { places: p, normals: n, film: { cells } } = this;
    n.fill(0);
    for (let c = 0; c < cells.length; c += 3) {
      const [i, j, k] = [3 * cells[c], 3 * cells[c + 1], 3 * cells[c + 2]];
      const [ax, ay, az] = [p[j] - p[i], p[j + 1] - p[i + 1], p[j + 2] - p[i + 2]];
      const [bx, by, bz] = [p[k] - p[i], p[k + 1] - p[i + 1], p[k + 2] - p[i + 2]];
      const [x, y, z] = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
      for (const at of [i, j, k]) {
        n[at] += x;
        n[at + 1] += y;
        n[at + 2] += z;
      }
    }
    return n;
  }
}

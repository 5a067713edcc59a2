// The moving film: what moves it, how fast, how much larger than it is, and from where it is seen.
import { h } from "dom";
import { Stage } from "surface";
import { divergingGradient, onTheme } from "theme";
import { number, scaled, withUnit } from "units";

const HIGH = 0.16; // of the film's size: how high the largest deflection is drawn at first
const SLOW = [0.5, 1, 2, 4, 8, 16]; // seconds that a period is shown in
const TURN = 0.01; // radians per pixel
const KEY_TURN = 0.12;
const [SMOOTH, SHARPEST] = [1.5, 2]; // pixels of the canvas per pixel of the page, at least and at most
const HURRY = 33; // milliseconds between pictures beyond which they are drawn with fewer pixels
const COARSEST = 0.75;

export class FilmView {
  constructor(place, film) {
    this.film = film;
    this.values = new Float32Array(film.count);
    this.theta = 0;
    this.playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.seen = false;
    this.ratio = Math.min(Math.max(devicePixelRatio, SMOOTH), SHARPEST);
    this.listeners = [];
    this.canvas = h("canvas", { className: "film", tabIndex: 0 });
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "the moving film; drag or arrows turn it, space stops it");
    this.caption = h("p", { className: "note" });
    place.append(this.canvas, this.bar(), this.controls(), this.caption);
    try {
      this.stage = new Stage(film, this.canvas);
    } catch {
      this.canvas.replaceWith(h("p", { className: "note" }, "This browser has no WebGL, which draws the moving film."));
      return;
    }
    this.listen();
  }

  // at(theta): amplitudes q of the modes; period in s, 0 for a shape without a time;
  // unit of q; samples: q over a period, to know how far the film moves
  show({ at, samples, period, unit, title }) {
    Object.assign(this, { at, period, unit });
    this.largest = 0;
    let highest = 0;
    samples.forEach((q, k) => {
      for (const value of this.film.deflection(q, this.values)) {
        if (Math.abs(value) > this.largest) [this.largest, highest] = [Math.abs(value), k];
      }
    });
    if (!this.playing) this.theta = (2 * Math.PI * highest) / Math.max(1, samples.length - 1); // a film that stands shows most
    this.title = title;
    this.write();
    this.draw();
  }

  write() {
    if (!this.at) return;
    const [factor, unit] = this.unit ? scaled(this.largest, this.unit) : [1, "φ"];
    const text = number(this.largest * factor, 4);
    this.ends[0].textContent = `−${text}`;
    this.ends[1].textContent = `${text} ${unit}`;
    const slowed = this.period ? `, slowed ${number(this.seconds / this.period, 2, 1e5)} times` : "";
    const size = this.unit ? `, deflection × ${number((this.magnified * this.film.size), 3)}` : "";
    const wide = Math.max(...this.film.stretch);
    const wider = wide > 1 ? `, drawn ${number(wide, 3)} times as wide as it is` : "";
    this.caption.textContent = `${this.title}${slowed}${size}${wider}`;
  }

  // Height of a unit of deflection, for a film of size 1
  get magnified() {
    return this.largest > 0 ? (this.high * HIGH) / this.largest : 0;
  }

  get seconds() {
    return SLOW[this.slow.value];
  }

  get high() {
    return 2 ** Number(this.tall.value);
  }

  bar() {
    this.ends = [h("span"), h("span")];
    const colours = h("span", { className: "colours" });
    colours.style.background = divergingGradient;
    return h("div", { className: "colourbar" }, this.ends[0], colours, this.ends[1]);
  }

  controls() {
    const range = (label, min, max, step, value) => h("input", { type: "range", ariaLabel: label, min, max, step, value, oninput: () => {
      this.write();
      this.draw();
    } });
    this.slow = range("seconds per period", 0, SLOW.length - 1, 1, 2);
    this.tall = range("height", -3, 2, 0.25, 0);
    this.play = h("button", { type: "button", onclick: () => this.toggle() }, this.playing ? "pause" : "play");
    const from = (name, ...view) => h("button", { type: "button", onclick: () => {
      this.stage.turn(...view);
      this.draw();
    } }, name);
    return h("div", { className: "controls" }, this.play,
      h("label", {}, "slower ", this.slow), h("label", {}, "higher ", this.tall),
      from("aslant", -0.5 * Math.PI - 0.5, 0.6, 1), from("above", -0.5 * Math.PI, 1.55, 1), from("side", -0.5 * Math.PI, 0.03, 1));
  }

  toggle() {
    this.playing = !this.playing;
    this.play.textContent = this.playing ? "pause" : "play";
    this.run();
  }

  listen() {
    let held = null;
    const { canvas, stage } = this;
    canvas.addEventListener("pointerdown", (event) => {
      held = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      stage.turn(stage.azimuth - TURN * (event.clientX - held[0]), stage.elevation + TURN * (event.clientY - held[1]), stage.near);
      held = [event.clientX, event.clientY];
      this.draw();
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { held = null; });
    canvas.addEventListener("keydown", (event) => this.key(event));
    onTheme(() => this.draw());
    new ResizeObserver(() => this.resize()).observe(canvas);
    new IntersectionObserver(([entry]) => {
      this.seen = entry.isIntersecting;
      this.run();
    }).observe(canvas);
  }

  key(event) {
    const turns = { ArrowLeft: [-1, 0, 1], ArrowRight: [1, 0, 1], ArrowUp: [0, 1, 1], ArrowDown: [0, -1, 1], "+": [0, 0, 1.2], "-": [0, 0, 1 / 1.2] };
    if (event.key === " ") this.toggle();
    else if (event.key in turns) {
      const [across, up, nearer] = turns[event.key];
      this.stage.turn(this.stage.azimuth + KEY_TURN * across, this.stage.elevation + KEY_TURN * up, this.stage.near * nearer);
      this.draw();
    } else return;
    event.preventDefault();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.stage.resize(clientWidth, clientHeight, this.ratio);
    this.draw();
  }

  run() {
    if (this.running || !this.stage) return;
    this.running = true;
    let last = performance.now();
    const step = (now) => {
      this.running = this.playing && this.seen && Boolean(this.at);
      if (!this.running) return;
      this.theta = (this.theta + (2 * Math.PI * (now - last)) / (1000 * this.seconds)) % (2 * Math.PI);
      this.adapt(now - last);
      last = now;
      this.draw();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  // Fewer pixels where pictures take long: without a graphics card.
  adapt(milliseconds) {
    this.between = 0.9 * (this.between ?? HURRY / 2) + 0.1 * milliseconds;
    if (this.between < HURRY || this.ratio <= COARSEST) return;
    this.ratio = Math.max(COARSEST, 0.7 * this.ratio);
    this.between = undefined;
    this.resize();
  }

  draw() {
    if (!this.at || !this.stage) return;
    this.film.deflection(this.at(this.theta), this.values);
    this.stage.draw(this.values, this.magnified, this.largest);
    this.listeners.forEach((tell) => tell(this.theta));
    this.pictures = (this.pictures ?? 0) + 1;
  }
}

export const heading = (orbit) => withUnit(orbit.omega / (2 * Math.PI), "Hz", 6);

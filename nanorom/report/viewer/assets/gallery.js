// Every mode as a small film, drawn once into pictures that are then shown in turn.
import { h } from "dom";
import { Stage } from "surface";
import { onTheme } from "theme";
import { largestOf, withUnit } from "units";

const STEPS = 8; // pictures from one extreme to the other
const MILLISECONDS = 90; // each
const [WIDTH, HEIGHT] = [216, 150]; // pixels of a picture
const HIGH = 0.16; // of the film's size
const FLAT = 0.1; // deflection of modes that move along the plane, as nanorom.rom.shapes has it

export class Gallery {
  // pick(r): what is done when a mode is chosen
  constructor(place, store, film, pick) {
    Object.assign(this, { film, step: 0 });
    const label = store.get("rom/label");
    const frequency = store.get("rom/frequency");
    this.tiles = Array.from({ length: film.modes }, (_, r) => {
      const canvas = h("canvas", { width: WIDTH, height: HEIGHT });
      const tile = h("button", { type: "button", className: "tile", title: "show it moving", onclick: () => pick(r) },
        canvas, h("span", {}, `${label[r]}${this.inPlane(r) ? ", in plane" : ""}`), h("small", {}, withUnit(frequency[r], "Hz", 6)));
      return { r, canvas, tile, pictures: [] };
    });
    place.append(h("div", { className: "gallery" }, ...this.tiles.map(({ tile }) => tile)));
    if (film.modes < frequency.length) {
      place.append(h("p", { className: "note" }, `Shapes of the lowest ${film.modes} of ${frequency.length} modes are part of the page.`));
    }
    try {
      this.stage = new Stage(film, h("canvas", { width: WIDTH, height: HEIGHT }));
    } catch {
      return; // the film says so
    }
    this.stage.resize(WIDTH, HEIGHT, 1);
    this.begin();
    onTheme(() => this.begin());
    new IntersectionObserver(([entry]) => this.run(entry.isIntersecting)).observe(place);
  }

  // Its shape, a deflection, shows nothing of the mode.
  inPlane(r) {
    const q = new Float64Array(this.film.modes);
    q[r] = 1;
    return largestOf(this.film.deflection(q)) < FLAT;
  }

  begin() {
    for (const tile of this.tiles) tile.pictures = [];
    this.waiting = this.tiles.flatMap((tile) => Array.from({ length: STEPS + 1 }, (_, k) => [tile, k]));
    this.waiting.sort(([, a], [, b]) => a - b);
    if (!this.working) this.work();
  }

  // One picture after another, while the page stays at hand.
  work() {
    this.working = this.waiting.length > 0;
    if (!this.working) return;
    const [tile, k] = this.waiting.shift();
    const q = new Float64Array(this.film.modes);
    q[tile.r] = Math.cos((Math.PI * k) / STEPS);
    this.stage.draw(this.film.deflection(q), HIGH, 1);
    const picture = h("canvas", { width: WIDTH, height: HEIGHT });
    picture.getContext("2d").drawImage(this.stage.renderer.domElement, 0, 0);
    tile.pictures[k] = picture;
    if (k === 0) this.paint(tile);
    setTimeout(() => this.work());
  }

  paint({ canvas, pictures }) {
    const k = this.step % (2 * STEPS);
    const picture = pictures[Math.min(k, 2 * STEPS - k)] ?? pictures[0];
    if (!picture) return;
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, WIDTH, HEIGHT);
    context.drawImage(picture, 0, 0);
  }

  run(seen) {
    clearInterval(this.timer);
    if (!seen || matchMedia("(prefers-reduced-motion: reduce)").matches) return;
    this.timer = setInterval(() => {
      this.step += 1;
      this.tiles.forEach((tile) => this.paint(tile));
    }, MILLISECONDS);
  }
}

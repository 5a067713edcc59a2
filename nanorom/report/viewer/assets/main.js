// Builds the page from what it holds.
import { h } from "dom";
import { Gallery } from "gallery";
import { LoadView } from "loads";
import { FilmView, MotionView } from "motion";
import { ResponseView } from "response";
import { Response, Selection } from "selection";
import { Store } from "store";
import { Film } from "surface";
import { linkRows } from "tables";
import { withUnit } from "units";
import { VerifiedView } from "verified";

export function start(table, data) {
  const store = new Store(table, data);
  const live = document.getElementById("live");
  const page = { store };
  globalThis.nanorom = page; // at hand in the browser's console
  const section = (title) => {
    const place = h("section", {}, h("h2", {}, title));
    live.append(place);
    return place;
  };
  const film = store.has("rom/shapes/values") ? new Film(store) : null;
  if (store.has("response/levels")) showResponse(page, section("Response"), film);
  if (film) showModes(page, section("Modes"), film);
  if (store.has("tuning/load")) page.loads = new LoadView(section("Load curve"), store);
  if (store.has("verified/omega")) page.verified = new VerifiedView(section("Model and film"), store);
  document.body.dataset.ready = "true";
}

function showResponse(page, place, film) {
  const response = new Response(page.store);
  const selection = new Selection();
  const same = film && page.store.get("rom/label").length === response.size;
  const [left, beside, below] = [h("div"), h("div", { className: "beside" }), h("div", { className: "below" })];
  place.append(h("div", { className: "split" }, left, beside), below);
  page.response = new ResponseView(left, response, selection);
  if (same) page.film = new FilmView(beside, film);
  page.motion = new MotionView({ beside, below }, response, selection, page.store, page.film);
  page.selection = selection;
  linkRows(response, selection);
  const first = largest(response);
  if (first) selection.set(first);
}

// The stable point of the largest amplitude within the swept range, to begin with.
function largest(response) {
  let [best, most] = [null, -1];
  for (const branch of response.branches) {
    branch.omega.forEach((omega, index) => {
      const hertz = omega / (2 * Math.PI);
      const size = Math.hypot(...branch.amplitude[index]);
      const within = hertz >= response.range[0] && hertz <= response.range[1];
      if (within && branch.stable[index] && size > most) [best, most] = [{ branch, index }, size];
    });
  }
  return best;
}

function showModes(page, place, film) {
  const { store } = page;
  let view = page.film;
  if (!view) {
    const alone = h("div", { className: "alone" });
    place.append(alone);
    view = page.film = new FilmView(alone, film);
  }
  const show = (r) => {
    const at = (theta) => {
      const q = new Float64Array(film.modes);
      q[r] = Math.cos(theta);
      return q;
    };
    const frequency = store.get("rom/frequency")[r];
    view.show({ at, samples: [at(0)], period: 1 / frequency, unit: "", title: `${store.get("rom/label")[r]}, ${withUnit(frequency, "Hz", 6)}` });
    view.run();
  };
  page.gallery = new Gallery(place, store, film, (r) => {
    show(r);
    view.canvas.scrollIntoView({ block: "nearest", behavior: "smooth" });
  });
  page.showMode = show;
  if (!page.response) show(0);
}

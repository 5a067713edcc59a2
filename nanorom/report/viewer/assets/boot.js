// Unpacks the modules of the page, which are part of it, and starts the one called main.
"use strict";
(async () => {
  const bytes = async (element) => {
    const text = atob(element.textContent);
    const raw = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
    const stream = new Blob([raw]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).arrayBuffer();
  };
  const imports = {};
  for (const element of document.querySelectorAll("script[data-packed]")) {
    if (element.dataset.packed === "data") continue;
    const code = new Blob([await bytes(element)], { type: "text/javascript" });
    imports[element.dataset.packed] = URL.createObjectURL(code);
  }
  const map = document.createElement("script");
  map.type = "importmap";
  map.textContent = JSON.stringify({ imports });
  document.head.append(map);
  const data = await bytes(document.querySelector('script[data-packed="data"]'));
  const table = JSON.parse(document.getElementById("table").textContent);
  (await import("main")).start(table, data);
})().catch((error) => {
  const note = document.createElement("p");
  note.className = "note";
  note.textContent = `This browser does not run the live part of the page: ${error.message}`;
  document.getElementById("live").append(note);
  throw error;
});

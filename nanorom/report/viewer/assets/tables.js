// The response as a table, and rows of the page's tables that lead to points of the diagram.

// As `nanorom export --to csv` writes it.
export function csv(response) {
  const headings = Object.values(response.store.get("response/headings"));
  const lines = [headings.map(quoted).join(",")];
  response.levels.forEach((level, k) => {
    const drive = [k + 1, level.direct, level.parametric];
    const row = (branch, multiple, stable, type, omega, amplitude) =>
      lines.push([...drive, branch, multiple, stable, type, omega / (2 * Math.PI), ...amplitude].join(","));
    for (const branch of response.branches.filter((other) => other.level === k)) {
      branch.omega.forEach((omega, i) =>
        row(branch.number, branch.multiple, branch.stable[i], "", omega, branch.amplitude[i]));
    }
    for (const point of response.points.filter((other) => other.level === k)) {
      row(point.branch, point.multiple, -1, point.type, point.omega, point.amplitude);
    }
  });
  return `${lines.join("\n")}\n`;
}

const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

// Columns by name as text.
export function columnsCsv(columns) {
  const names = Object.keys(columns);
  const lines = [names.map(quoted).join(",")];
  for (let i = 0; i < columns[names[0]].length; i++) {
    lines.push(names.map((name) => (Number.isNaN(columns[name][i]) ? "nan" : columns[name][i])).join(","));
  }
  return `${lines.join("\n")}\n`;
}

// A click or Enter on a row of the table of special points selects the point.
export function linkRows(response, selection) {
  for (const table of document.querySelectorAll("[data-rows=special-points] table")) {
    [...table.tBodies[0].rows].forEach((row, i) => {
      const special = response.points[i];
      const go = () => {
        selection.set({ special, index: special.index });
        document.getElementById("live").scrollIntoView();
      };
      row.tabIndex = 0;
      row.className = "link";
      row.addEventListener("click", go);
      row.addEventListener("keydown", (event) => { if (event.key === "Enter") go(); });
    });
  }
}

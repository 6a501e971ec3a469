/* Tables of numbers: a small grid, and the curve that it means. */
function tableRow(path, one, value, put, named = false) {
  const rows = Array.isArray(value) ? value : [], label = element("label", { title: one.about }, one.name);
  const button = element("button", { className: "quiet" }, rows.length ? `${rows.length} rows …` : "Fill in …");
  button.dataset.path = path;
  const line = element("div", { className: `field table${named && !rows.length ? " missing" : ""}` }, label, button,
    curveOf(rows));
  button.onclick = () => editTable(path, one, rows, async (filled) => {
    const why = await put(filled);
    if (!why) { rows.splice(0, rows.length, ...filled); button.textContent = `${filled.length} rows …`;
    line.querySelector("svg").replaceWith(curveOf(filled)); line.classList.remove("missing"); }
    return why;
  });
  return line;
}

/* The other columns over the first; numbers with units by their numbers. */
function curveOf(rows) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg"), numbers = rows.map((one) =>
    (Array.isArray(one) ? one : [one]).map(parseFloat));
  svg.setAttribute("viewBox", "0 0 120 40");
  svg.classList.add("curve");
  const width = Math.max(0, ...numbers.map((one) => one.length)), flat = width === 1;
  const x = (one, k) => flat ? k : one[0], xs = range([numbers.map(x)]), scale = (value, [low, high]) =>
    high > low ? (value - low) / (high - low) : 0.5;
  const ys = range(numbers.map((one) => flat ? one : one.slice(1)));
  for (let c = flat ? 0 : 1; c < width && numbers.length > 1; c++) {
    const path = document.createElementNS("http://www.w3.org/2000/svg", "path"), points = numbers.map((one, k) =>
      [x(one, k), one[c]]).filter((point) => point.every(Number.isFinite));
    path.setAttribute("d", points.map(([u, v], k) =>
      `${k ? "L" : "M"}${(3 + 114 * scale(u, xs)).toFixed(1)} ${(37 - 34 * scale(v, ys)).toFixed(1)}`).join(""));
    path.setAttribute("stroke", `var(--c${(c - 1) % COLOURS})`);
    svg.append(path);
  }
  return svg;
}

function editTable(path, one, rows, put) {
  const flat = one.columns.length === 0, titles = flat ? [one.about] : one.columns.map((column) => column.about),
    longest = Math.max(titles.length, ...rows.map((row) => Array.isArray(row) ? row.length : 1));
  const grid = element("tbody"), said = element("p", { className: "refused" }), preview = element("div");
  const cells = () => [...grid.rows].map((line) => [...line.querySelectorAll("input")].map((cell) =>
    cell.value.trim())).filter((line) => line.some(Boolean));
  const filled = () => cells().map((line) => { while (line.length > titles.length && line.at(-1) === "") line.pop();
  const read = line.map((cell, k) => one.columns[k]?.text ? cell : meantBy(cell));
  return flat && longest === 1 ? read[0] : read; });
  const line = (row, width) => {
    const remove = element("button", { type: "button", className: "quiet", ariaLabel: "Remove the row" }, "×");
    const made = element("tr", {}, ...Array.from({ length: width }, (_, k) => element("td", {}, element("input",
      { value: written((Array.isArray(row) ? row : [row])[k]),
        ariaLabel: `row ${grid.rows.length + 1}, column ${k + 1}` }))), element("td", {}, remove));
    remove.onclick = () => { made.remove(); refresh(); };
    return made;
  };
  const refresh = () => { preview.replaceChildren(curveOf(filled()));
  if (![...grid.rows].length || cells().length === grid.rows.length) grid.append(line([], width)); };
  let width = longest;
  const wider = element("button", { type: "button", className: "quiet" }, "Another column");
  wider.onclick = () => { width += 1; for (const row of grid.rows) row.lastChild.before(element("td", {},
    element("input"))); };
  grid.append(...rows.map((row) => line(row, width)));
  refresh();
  grid.oninput = refresh;
  grid.onpaste = (event) => { // from a spreadsheet
    const text = event.clipboardData.getData("text/plain").trim();
    if (!/[\t\n]/.test(text)) return;
    event.preventDefault();
    grid.replaceChildren(...text.split(/\r?\n/).map((one) => line(one.split("\t"), width)));
    refresh();
  };
  const ok = element("button", { className: "main", type: "button" }, "OK"), cancel = element("button",
    { type: "button" }, "Cancel");
  ok.onclick = async () => { const why = await put(filled()); if (why) said.textContent = why;
  else at("dialog").close("ok"); };
  cancel.onclick = () => at("dialog").close();
  at("dialog").onclose = null;
  at("dialog").replaceChildren(element("h2", {}, path), element("p", { className: "about" }, one.about), preview,
    element("div", { className: "scroll" }, element("table", { className: "grid" },
    element("thead", {}, element("tr", {}, ...titles.map((title) => element("th", {}, title)))), grid)), said,
      element("div", { className: "row" }, ...(flat && longest === 1 ? [] : [wider]), cancel, ok));
  at("dialog").showModal();
}

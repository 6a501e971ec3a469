/* The values of what is selected: of parts, of a line, or of the whole drive. */
let inspecting = 0, startRows = { revision: -1, rows: new Map() };

const written = (value) =>
  value === undefined || value === null ? "" : typeof value === "object" ? JSON.stringify(value) : String(value);
/* What a field means in a netlist: a number or truth as such, everything else as text. */
const meantBy = (text) =>
  /^(true|false)$/.test(text) ? text === "true" : /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text) ? Number(text) : text;

async function inspect() {
  const mine = ++inspecting, names = chosen();
  clipping = "";
  if (names.length) ask("copy", { names }).then((text) => { if (mine === inspecting) clipping = text; }, () => null);
  const made = page.line ? aboutLine(page.line) : names.length > 1 ? aboutMany(names)
    : names.length ? await aboutPart([...page.selected][0], mine) : aboutDrive();
  if (mine !== inspecting || !made) return;
  const active = document.activeElement, place = at("inspector").contains(active) ? active.dataset.path : null;
  // What is being typed stays: when it is written, all is drawn again.
  if (place && active.was !== undefined && active.value !== active.was) return;
  at("inspector").replaceChildren(...made);
  if (place) [...at("inspector").querySelectorAll("[data-path]")].find((one) => one.dataset.path === place)?.focus();
}

/* ---- fields ---- */

/* A row with a field; `put` writes what is typed, `remove` is called where it is emptied. */
function row({ label, title = "", path, value, fallback = "", unit = "", units = [], choices = [], missing = false,
  more = [] }, put) {
  let field;
  if (choices.length) {
    field = element("select", {}, ...(fallback !== "" || value === "" ? [element("option", { value: "" },
      fallback === "" ? "" : `${fallback} (default)`)] : []),
      ...choices.map((one) => element("option", { value: String(one) }, String(one))));
    field.value = value;
  } else {
    field = element("input", { value,
      placeholder: missing ? "needs a value" : fallback === "" ? "" : `${fallback}${unit ? ` ${unit}` : ""}`,
        autocomplete: "off", spellcheck: false });
    field.setAttribute("list", "formulas");
    field.oninput = () => suggest(field, units.length ? units : unit ? [unit] : []);
  }
  field.dataset.path = path;
  field.was = value;
  field.ariaLabel = path;
  const line = element("div", { className: `field${missing ? " missing" : ""}` }, element("label", { title }, label),
    field,
    element("span", { className: "unit" }, unit), ...more);
  const said = element("p", { className: "refused" });
  field.onchange = async () => {
    if (field.value.trim() === field.was) return;
    field.was = field.value;
    const error = await put(field.value.trim());
    said.textContent = error ?? "";
    line.classList.toggle("missing", !!error || missing);
    if (error && !said.isConnected) line.append(said);
  };
  field.onkeydown = (event) => {
    if (event.key === "Escape") { field.value = value; field.blur(); event.stopPropagation(); }
    if (event.key === "Enter") { event.preventDefault(); field.dispatchEvent(new Event("change")); }
  };
  return line;
}

/* Formulas complete names of parameters; a number with a blank behind it completes units. */
function suggest(field, units) {
  const number = /^\s*[+-]?[\d.]+(?:e[+-]?\d+)?\s/i.exec(field.value), names = Object.keys(section("parameters"));
  const words = number ? units.map((unit) => `${number[0].trim()} ${unit}`)
    : names.map((name) => field.value.replace(/[A-Za-z_]\w*$/, "") + name);
  at("formulas").replaceChildren(...words.map((value) => element("option", { value })));
}

/* Writes a value; returns why it is refused. */
async function put(path, text, request = {}) {
  const op = text === "" ? { op: "unset", path, ...request } : { op: "set", path, value: meantBy(text), ...request };
  return change("apply", { request: op }).then(() => null, (error) => error.message);
}

/* A slider runs the drive with another value at once; when it is let go, that is written. */
function slider(path) {
  const known = results.content?.sliders.find((one) => one.name === path);
  if (!known || typeof known.value !== "number") return [];
  const range = element("input", { type: "range", min: 0, max: 1, step: "any", ariaLabel: path });
  range.value = positionOf(known, results.given.get(path) ?? known.value);
  const number = () => Number(valueAt(known, range.valueAsNumber).toPrecision(4));
  range.oninput = () => { const field = range.parentNode.querySelector("input:not([type])");
  if (field) field.value = inUnit(known, number());
  tryValue(path, number()); };
  range.onchange = async () => {
    const why = await put(path, inUnit(known, number()));
    if (why) tell(new Error(why));
  };
  return [range];
}

/* ---- the drive ---- */

function aboutDrive() {
  const values = section("parameters"), run = section("simulate"), sheet = (label, path, title) =>
    row({ label, title, path, value: written(page.data[path]) }, (text) => put(path, text, { section: "" }));
  const rows = Object.entries(values).map(([name, value]) => parameterRow(name, value));
  const add = element("button", { className: "quiet" }, "Add a parameter");
  add.onclick = async () => {
    const answer = await question("New parameter", [{ name: "name", label: "Name" }, { name: "value",
      label: "Value, such as 3 kg or 2*mass" }], "Add");
    if (answer?.name) { const why = await put(answer.name, answer.value); if (why) tell(new Error(why)); }
  };
  const list = Object.keys(parts()).map((name) => {
    const button = element("button", { className: "part" }, element("b", {}, name), element("small", {},
      String(tableOf(name).is ?? "")));
    button.onclick = () => select([name]);
    return button;
  });
  return [element("h2", {}, written(page.data.name) || page.file || ""), sheet("name", "name",
    "by default that of the file"), sheet("description", "description", "one phrase"),
    element("h3", {}, "Parameters"), ...rows, add, element("h3", {}, "Run"),
    row({ label: "until", path: "simulate.until", value: written(run.until), unit: "s", fallback: "1" }, (text) =>
      put("until", text, { section: "simulate" })),
    row({ label: "start", path: "simulate.start", value: written(run.start), choices: ["given", "rest", "steady"],
      fallback: "given" },
      (text) => put("start", text, { section: "simulate" })),
    ...(list.length ? [element("h3", {}, "Parts"), element("div", { className: "list" }, ...list)] : [])];
}

function parameterRow(name, value) {
  const remove = element("button", { className: "quiet", title: `Remove ${name}`, ariaLabel: `Remove ${name}` }, "×");
  remove.onclick = () => apply({ op: "unset", path: name });
  return row({ label: name, path: name, value: written(value), more: [remove, ...slider(name)] }, (text) => put(name,
    text));
}

/* ---- parts ---- */

async function aboutPart(name, mine) {
  const table = tableOf(name), kind = String(table.is ?? ""), known = await kindOf(kind);
  if (mine !== inspecting) return null;
  return [...titleOf(name, kind, known), ...(known ? valuesOf(name, table, known) : [element("p", { className: "dim" },
    "The type is not known, so its values cannot be shown.")]),
    ...insideOf(name, table, known), ...curvesOf(name), ...startsOf(name, table, known)];
}

function titleOf(name, kind, known) {
  const title = element("input", { className: "name", value: name, ariaLabel: "name of the part", spellcheck: false });
  title.onchange = async () => {
    const to = title.value.trim();
    if (!to || to === name) return;
    if (await apply({ op: "rename", old: head(name), new: to })) select([to]); else title.value = name;
  };
  title.onkeydown = (event) => { if (event.key === "Enter") title.blur();
  if (event.key === "Escape") { title.value = name; title.blur(); } };
  const button = (text, action, about = "") => { const made = element("button", { className: "quiet", title: about },
    text); made.onclick = action; return made; };
  const [first, ...rest] = (known?.about ?? "").split("\n").slice(1).join("\n").trim().split("\n");
  const about = first ? [rest.join("").trim() ? element("details", { className: "about" }, element("summary", {},
    first), element("pre", {}, rest.join("\n").trim()))
    : element("p", { className: "about" }, first)] : [];
  return [title, element("div", { className: "row" }, ...(known?.symbol ? [pictureOf(known.symbol)] : []),
    element("span", { className: "kind" }, kind), button("Replace …",
    () => replacing(head(name)), "Another type"),
    ...(known && !openable(name) ? [button("Page", () => showPage(kind), "All about the type, with its equations")] : []),
    button("Duplicate", duplicateChosen, "Ctrl+D"), ...(openable(name) ? [button("Open", () => openPart(name),
      "Enter")] : []),
    button("Remove", removeChosen, "Del")), ...about];
}

/* The page of a class: its tables, and its equations as they are written. */
async function showPage(kind) {
  const answer = await ask("page", { kind }).catch(tell), known = await kindOf(kind);
  if (!answer) return;
  const plain = (text) => text.replace(/\$[^$]*\$( in )?/g, "").replace(/[`]|\\(?=\|)/g, "").replace(/\[([^\]]*)\]\([^)]*\)/g,
    "$1").trim(), blocks = [];
  for (const line of answer.text.split("\n")) {
    const cells = /^\|/.test(line) && line.split(/(?<!\\)\|/).slice(1, -1).filter((cell) =>
      !/^ (symbol|\$[^$]*\$) $/.test(cell)).map(plain); // what stands only in formulas
    if (cells && cells.every((cell) => /^-*$/.test(cell))) continue;
    const table = blocks.at(-1)?.matches("table") ? blocks.at(-1) : null;
    if (cells && table) table.append(element("tr", {}, ...cells.map((cell) => element("td", {}, cell))));
    else if (cells) blocks.push(element("table", {}, element("tr", {}, ...cells.map((cell) => element("th", {}, cell)))));
    else if (line.startsWith("## ")) blocks.push(element("h3", {}, line.slice(3)));
    else if (line.trim()) blocks.push(element("p", {}, plain(line)));
  }
  at("dialog").onclose = null;
  at("dialog").replaceChildren(element("h2", {}, kind), element("div", { className: "scroll page" }, element("pre", {},
    known?.about.split("\n").slice(1).join("\n").trim() ?? ""), ...blocks, element("h3", {}, "Equations"),
    element("pre", {}, answer.source)), element("form", { method: "dialog" }, element("div", { className: "row" },
    element("button", { className: "main" }, "Close"))));
  at("dialog").showModal();
}

/* Missing values of a part, as the problems tell them. */
function missingOf(name) {
  return new Map(page.problems.filter((one) => one.kind !== "note").map((one) => [placeOf(one),
    one.what]).filter(([place]) => place.part === head(name) && place.value)
    .map(([place, what]) => [place.value, what]));
}

function valuesOf(name, table, known) {
  const missing = missingOf(name), path = (key) => `${name}.${key}`;
  const make = (one) => {
    const { name: key, about, unit, least, most, choices, sort } = one, value = table[key],
      fallback = one.default ?? "";
    const limits = [least !== null && `at least ${least}`, most !== null &&
      `at most ${most}`].filter(Boolean).join(", ");
    const title = [about, limits && `${limits}${unit ? ` ${unit}` : ""}`, missing.get(key)].filter(Boolean).join("\n");
    if (sort === "table") return tableRow(path(key), one, value, (rows) => change("apply", { request: { op: "set",
      path: path(key), value: rows } }).then(() => null, (error) => error.message));
    return row({ label: key, title, path: path(key), value: written(value), fallback: written(fallback), unit,
      units: one.units, choices,
      missing: missing.has(key), more: slider(path(key)) }, (text) => put(path(key), text));
  };
  const shown = known.values.filter((one) => !["start", "mode"].includes(one.sort));
  const first = shown.filter((one) => one.name in table || missing.has(one.name) || (one.default === null &&
    one.sort === "parameter"));
  const others = shown.filter((one) => !first.includes(one)), inner = innerOf(table, missing, known);
  return [...first.map(make), ...inner.map(([key, value]) => row({ label: key, title: missing.get(key),
    path: path(key), value: written(value), missing: missing.has(key), more: slider(path(key)) }, (text) =>
      put(path(key), text))),
    ...(others.length ? [element("details", { open: !first.length }, element("summary", {},
      `${others.length} with defaults`), ...others.map(make))] : [])];
}

const opened = new Set(); // parts inside whose values are shown

/* The parts inside a part, with their values, which are asked for when they are opened. */
function insideOf(name, table, known) {
  const missing = missingOf(name);
  const rows = (known?.parts ?? []).map((inner) => {
    const path = `${name}.${inner}`, box = element("details", {}, element("summary", {}, inner));
    box.dataset.inside = path;
    const fill = async () => {
      const owner = await kindOf(String(table.is), [inner]), given = (table[inner] &&
        typeof table[inner] === "object") ? table[inner] : {};
      const fields = (owner?.values ?? []).filter((one) => ["parameter", "structure"].includes(one.sort) &&
        !innerOf(table, missing, known).some(([key]) => key === `${inner}.${one.name}`));
      box.replaceChildren(box.firstChild, ...fields.map((one) => row({ label: one.name, title: one.about,
        path: `${path}.${one.name}`, value: written(given[one.name]), fallback: written(one.default ?? ""),
        unit: one.unit, units: one.units, choices: one.choices }, (text) => put(`${path}.${one.name}`, text))));
    };
    box.ontoggle = () => { if (box.open) { opened.add(path); if (box.children.length < 2) fill();
    } else opened.delete(path); };
    box.open = opened.has(path);
    return box;
  });
  return rows.length ? [element("h3", {}, "Parts inside"), ...rows] : [];
}

/* Values of parts inside a part, by their paths: those that are given, and those that are missing. */
function innerOf(table, missing, known) {
  const rows = new Map(), own = new Set(["is", "count", ...known.values.map((one) => one.name)]);
  const add = (key, value) => value && typeof value === "object" && !Array.isArray(value)
    ? Object.entries(value).forEach(([name, inner]) => add(`${key}.${name}`, inner)) : rows.set(key, value);
  for (const [key, value] of Object.entries(table)) if (!own.has(key)) add(key, value);
  for (const key of missing.keys()) if (!own.has(key) && !rows.has(key)) rows.set(key, "");
  return [...rows];
}

/* Signals of a part: a click draws them; modes as the run left them. */
function curvesOf(name) {
  const content = results.content;
  if (!content) return [];
  const mine = content.variables.filter((one) => one.name.startsWith(`${name}.`) && !one.tree);
  const chips = mine.map((one) => {
    const chip = element("button", { className: "chip", title: one.description || one.name,
      ariaPressed: results.shown.includes(one.name) }, one.name.slice(name.length + 1));
    chip.onclick = () => { toggleCurve(one.name); chip.ariaPressed = results.shown.includes(one.name); };
    chip.draggable = true;
    chip.ondragstart = (event) => event.dataTransfer.setData("text/plain", one.name);
    return chip;
  });
  const run = results.run, modes = run ? modesOf(content).filter((one) => one.name.startsWith(`${name}.`)).map((one) =>
    [one, values(run, one).at(-1)])
    .filter(([one, value]) => one.names[value] !== undefined) : [];
  return [...(chips.length ? [element("h3", {}, "Curves"), element("div", { className: "chips" }, ...chips)] : []),
    ...(modes.length ? [element("h3", {}, "Modes at the end"), ...modes.map(([one, value]) => element("p",
      { className: "dim" }, `${one.name.slice(name.length + 1)}: ${one.names[value]}`))] : [])];
}

function startsOf(name, table, known) {
  const rows = (known?.values ?? []).filter((one) => ["start", "mode"].includes(one.sort)).map((one) => {
    const path = `${name}.${one.name}`, guessed = path in section("guess");
    const value = written(table[one.name] ?? section("start")[path] ?? section("guess")[path]),
      now = startRows.rows.get(path);
    const kind = element("select", { ariaLabel: `${path}: given or guess`, className: "given" }, ...["given",
      "guess"].map((word) => element("option", {}, word)));
    kind.value = guessed ? "guess" : "given";
    kind.onchange = () => value && apply({ op: "together", steps: [{ op: "unset", path }, { op: "set", path,
      value: meantBy(value), section: kind.value === "guess" ? "guess" : "start" }] });
    const origin = now ? [element("small", { className: "dim origin" },
      `${short(now.value)} ${now.unit === "1" ? "" : now.unit} · ${now.origin}`)] : [];
    return row({ label: one.name, title: one.about, path, value, unit: one.unit, units: one.units,
      choices: one.choices, more: [...(value ? [kind] : []), ...origin] },
      (text) => put(path, text, guessed ? { section: "guess" } : {}));
  });
  const box = element("details", { open: startsOpen }, element("summary", {}, "Start values"), ...rows);
  box.ontoggle = () => { startsOpen = box.open; if (box.open) loadStarts(); };
  if (startsOpen) loadStarts();
  return rows.length ? [box] : [];
}

let startsOpen = false;
async function loadStarts() {
  if (startRows.revision === page.revision || !results.content) return;
  const revision = startRows.revision = page.revision;
  const rows = await ask("starts", { revision }).catch(() => []); // why is told where the drive does not run
  if (!rows.length && startRows.revision === revision) startRows.revision = -1; // it was asked too early
  startRows.rows = new Map(rows.map((one) => [one.path, one]));
  if (rows.length) inspect();
}

/* A part that cannot be without some values: they are asked for before it is there. */
async function draft(request, why) {
  const known = await kindOf(request.kind), given = new Map(), mine = ++inspecting;
  const make = (one) => {
    const named = new RegExp(`\\b${one.name}\\b`).test(why);
    const keep = async (value) => { if (value === "" || value === null) given.delete(one.name);
    else given.set(one.name, value); return null; };
    if (one.sort === "table") return tableRow(`${request.name}.${one.name}`, one, given.get(one.name), keep, named);
    return row({ label: one.name, title: one.about, path: `${request.name}.${one.name}`, value: "",
      fallback: written(one.default ?? ""), unit: one.unit,
      units: one.units, choices: one.choices, missing: named }, (text) => keep(text === "" ? "" : meantBy(text)));
  };
  const add = element("button", { className: "main" }, "Put it on the sheet"), cancel = element("button", {},
    "Cancel"), said = element("p", { className: "refused" }, why);
  add.onclick = async () => {
    const ready = { ...request, values: Object.fromEntries(given) };
    await change("apply", { request: ready }).then(() => select([ready.name]), (error) =>
      said.textContent = error.message);
  };
  cancel.onclick = () => inspect();
  if (mine !== inspecting || !known) return;
  at("inspector").replaceChildren(element("h2", {}, request.name), element("p", { className: "kind" },
    `${request.kind}, not yet on the sheet`), said,
    ...known.values.filter((one) => !["start", "mode"].includes(one.sort)).map(make), element("div",
      { className: "row" }, cancel, add));
}

/* ---- several parts, lines ---- */

function aboutMany(names) {
  const button = (text, action) => { const made = element("button", {}, text); made.onclick = action; return made; };
  return [element("h2", {}, `${names.length} parts`), element("p", { className: "dim" }, names.join(", ")),
    element("div", { className: "row" }, button("Group …", groupChosen), button("Duplicate", duplicateChosen),
      button("Remove", removeChosen))];
}

function aboutLine(line) {
  const rows = line.map((end) => {
    const off = element("button", { className: "quiet" }, "Separate");
    off.onclick = () => line.length === 2 ? separate(line) : apply({ op: "disconnect", first: end });
    const name = element("button", { className: "part" }, end);
    name.onclick = () => select([end.split(".").slice(0, -1).join(".")]);
    return element("div", { className: "row" }, name, off);
  });
  return [element("h2", {}, "Connection"), ...rows];
}

listeners.push(() => inspect());

/* What a hand does in the picture: it carries parts from the shelf, joins ends, selects, and uses keys. */
const MOVED = 5; // pixels after which a click is a drag
let carried = null; // { kind, replace? } from the shelf
let joining = null; // { end, fits, drag }
let pressed = null; // where the pointer went down

/* ---- parts from the shelf ---- */

function carry(entry) {
  drop();
  carried = entry;
  document.body.classList.toggle("carrying", !!entry);
  if (entry) say(`${entry.kind}: click a line to insert it, an end to join it, or the sheet. Esc puts it back.`,
    "note");
}

function drop() {
  if (carried || joining) say("");
  [carried, joining] = [null, null];
  document.body.classList.remove("carrying");
  at("sheet").classList.remove("joining");
  at("sheet").querySelector("#rubber")?.remove();
  for (const end of at("sheet").querySelectorAll(".end")) end.classList.remove("fit", "misfit", "from");
}

/* Puts a part of a type somewhere; what it cannot be without is asked for in the inspector. */
async function place(kind, where, event) {
  const spot = where.end ? { end: where.end } : where.line ? { line: between(where.line, event) } : {};
  const request = { op: "place", name: unusedName(kind), kind, at: spot };
  drop();
  try {
    await change("apply", { request });
    select([request.name]);
  } catch (error) {
    if (/needs (a value|values) for|needs .* for /.test(error.message)) return draft(request, error.message);
    tell(error);
  }
}

/* ---- ends ---- */

async function join(end, drag = false) {
  drop();
  const mine = joining = { end, drag, fits: {} };
  at("sheet").classList.add("joining");
  endAt(end)?.classList.add("from");
  const fits = await ask("fits", { end }).catch(tell);
  if (joining !== mine) return;
  if (!fits) return drop();
  mine.fits = fits;
  for (const one of at("sheet").querySelectorAll(".end")) {
    const why = fits[one.dataset.end];
    one.classList.toggle("fit", why === "");
    one.classList.toggle("misfit", !!why);
  }
  if (!drag) say(`${end}: click the end to which it is joined. Esc ends this.`, "note");
}

async function joined(end) {
  const { end: first, fits } = joining, why = fits[end];
  if (end === first) return drop();
  drop();
  if (why) return say(why, "refused");
  await apply({ op: "connect", first, second: end });
}

function rubber(event) {
  const svg = drawing(), from = endAt(joining.end);
  if (!svg || !from) return;
  let line = svg.querySelector("#rubber");
  if (!line) {
    line = document.createElementNS("http://www.w3.org/2000/svg", "line");
    line.id = "rubber";
    svg.append(line);
  }
  const place = (x, y) => new DOMPoint(x, y).matrixTransform(svg.getScreenCTM().inverse());
  const box = from.getBoundingClientRect(), a = place(box.x + box.width / 2, box.y + box.height / 2);
  const b = place(event.clientX, event.clientY);
  for (const [name, value] of Object.entries({ x1: a.x, y1: a.y, x2: b.x, y2: b.y })) line.setAttribute(name, value);
}

/* ---- pointer ---- */

function down(event) {
  if (event.button || !page.picture && !carried) return;
  const what = meant(event);
  pressed = { x: event.clientX, y: event.clientY, what, moved: false };
  if (what.end && !carried && !joining && !playing.on) pressed.from = what.end;
}

function move(event) {
  if (held && Math.hypot(event.clientX - held.x, event.clientY - held.y) > MOVED) {
    held.take();
    [carried.dragged, held] = [true, null];
  }
  if (carried) return hover(event);
  if (pressed && Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > MOVED && !pressed.moved) {
    pressed.moved = true;
    if (pressed.from) join(pressed.from, true);
  }
  if (joining) { rubber(event); hover(event); }
}

/* The reason why an end does not fit, while the pointer is over it. */
function hover(event) {
  const what = meant(event), why = joining && what.end && joining.fits[what.end];
  hint(why || (carried && what.line ? `insert ${carried.kind} here` : ""), event);
  for (const one of at("sheet").querySelectorAll(".target")) if (one !== what.node) one.classList.remove("target");
  if (carried && what.node && !what.part) what.node.classList.add("target");
}

function up(event) {
  const start = pressed, what = meant(event);
  [pressed, held] = [null, null];
  hint("");
  if (carried?.dragged || (carried && start)) return lay(what, event);
  if (!start) return;
  if (joining?.drag) return start.moved && what.end ? joined(what.end) : drop();
  if (joining) return what.end ? joined(what.end) : drop();
  if (start.moved) return;
  if (what.end) return join(what.end);
  if (what.part) return pick(what.part, event.shiftKey || event.ctrlKey || event.metaKey);
  if (what.line) return select([], what.line);
  if (what.sheet) select([]);
}

function lay(what, event) {
  const { kind, replace } = carried;
  if (!what.node) return drop();
  if (replace) { drop(); return apply({ op: "replace", name: replace, kind }); }
  if (what.part && !playing.on) { // beside its outlet
    say("Click a line, an end or the sheet.", "note");
    return;
  }
  place(kind, what, event);
}

function pick(name, more) {
  const names = new Set(more ? page.selected : []);
  if (more && names.has(name)) names.delete(name); else names.add(name);
  select([...names]);
}

/* ---- what can be done with what is selected ---- */

const chosen = () => [...new Set([...page.selected].map(head))];

async function removeChosen() {
  if (page.line) return separate(page.line);
  const names = chosen();
  if (names.length) await apply({ op: "together", steps: names.map((name) => ({ op: "remove", name })) });
}

/* Of many ends, all but one leave the line. */
async function separate(line) {
  if (line.length === 2) return apply({ op: "disconnect", first: line[0], second: line[1] });
  return apply({ op: "together", steps: line.slice(0, 1).map((first) => ({ op: "disconnect", first })) });
}

async function duplicateChosen() {
  const names = chosen();
  if (!names.length) return;
  const pasted = await ask("copy", { names }).catch(tell);
  if (pasted) await paste(pasted);
}

async function paste(text) {
  const before = new Set(Object.keys(parts()));
  if (await apply({ op: "paste", text })) select(Object.keys(parts()).filter((name) => !before.has(name)));
}

async function groupChosen() {
  const names = chosen();
  if (names.length < 1) return;
  const answer = await question("Group parts", [{ name: "name", label: "Name of the assembly and its file",
    value: "group" }],
    "Group", `${names.join(", ")} become a netlist of their own, used as one part.`);
  if (answer?.name && await apply({ op: "group", names, name: answer.name })) select([answer.name]);
}

const openable = (name) => String(tableOf(name).is ?? "").endsWith(".toml");

async function openPart(name) {
  if (!openable(name)) return;
  page.selected.clear();
  await change("open", { file: tableOf(name).is }).catch(tell);
}

/* ---- keys ---- */

const typing = (target) => target.closest?.("input, textarea, select, dialog, [contenteditable]");

function keyed(event) {
  const key = event.key, control = event.ctrlKey || event.metaKey, target = event.target;
  const files = { s: () => save(), e: () => fold("text"), z: () => step(event.shiftKey ? "redo" : "undo"), y: () =>
    step("redo") };
  if (control && files[key.toLowerCase()] && !(typing(target) && "zy".includes(key.toLowerCase()) &&
    target.id !== "text")) {
    event.preventDefault();
    return files[key.toLowerCase()]();
  }
  if (key === "Escape") return escape();
  if (typing(target)) return;
  const tools = { d: duplicateChosen, g: groupChosen, a: () => select(Object.keys(parts())) };
  if (control && tools[key.toLowerCase()]) { event.preventDefault(); return tools[key.toLowerCase()](); }
  if (control) return;
  const plain = { "/": () => (fold("shelf", true), at("search").focus()), "?": keys, Delete: removeChosen,
    Backspace: removeChosen, F2: () => at("inspector").querySelector(".name")?.select(), " ": () => playing.on &&
      play() };
  if (plain[key]) { event.preventDefault(); return plain[key](); }
  if (key.startsWith("Arrow") && target.closest("#sheet")) {
    const next = neighbour([...page.selected].pop() ?? "", key);
    if (next) { event.preventDefault(); next.focus(); select([next.dataset.part]); }
  }
  if (key === "Enter" && target.closest("#sheet")) enter(target, event);
}

function enter(target, event) {
  const { end, part, ends } = target.dataset ?? {};
  event.preventDefault();
  if (carried) return lay(end ? { end, node: target } : ends ? { line: ends.split(" "), node: target } : { sheet: true,
    node: target });
  if (end) return joining ? joined(end) : join(end);
  if (ends) return select([], ends.split(" "));
  if (part) return page.selected.has(part) && openable(part) ? openPart(part) : pick(part, event.shiftKey);
}

function escape() {
  if (at("dialog").open) return;
  if (!at("words").hidden) return words([]);
  if (carried || joining) return drop();
  if (playing.on) return leave();
  select([]);
}

const step = (what) => change(what, {}).catch(tell);

const KEYS = [["/", "find a part; Enter takes it"], ["Tab, Enter", "go to parts, ends and lines; take, join, insert"],
  ["arrows", "next part"], ["Del", "remove; neighbours in series are joined again"], ["F2", "rename"], ["Ctrl+D",
    "duplicate"],
  ["Ctrl+C, Ctrl+X, Ctrl+V", "copy, cut, paste as netlist text"], ["Ctrl+G", "group into an assembly"],
  ["Enter, double click", "open an assembly"], ["Ctrl+Z, Ctrl+Y", "undo, redo"], ["Ctrl+S", "save"], ["Ctrl+E", "text"],
  ["Ctrl+Space", "complete in the text"], ["Esc", "leave"]];

function keys() {
  const rows = KEYS.map(([key, what]) => element("tr", {}, element("th", {}, key), element("td", {}, what)));
  at("dialog").replaceChildren(element("h2", {}, "Keys"), element("table", {}, ...rows),
    element("form", { method: "dialog" }, element("button", { className: "main" }, "Close")));
  at("dialog").showModal();
}

function hint(text, event) {
  const place = at("hint");
  place.hidden = !text;
  place.textContent = text;
  if (text) Object.assign(place.style, { left: `${Math.min(event.clientX + 14, innerWidth - 330)}px`,
    top: `${event.clientY + 16}px` });
}

function listenToHand() {
  at("sheet").addEventListener("pointerdown", down);
  document.addEventListener("pointermove", move);
  document.addEventListener("pointerup", up);
  at("sheet").addEventListener("dblclick", (event) => { const { part } = meant(event); if (part) openPart(part); });
  document.addEventListener("keydown", keyed);
  document.addEventListener("copy", (event) => clip(event, false));
  document.addEventListener("cut", (event) => clip(event, true));
  document.addEventListener("paste", (event) => {
    if (typing(event.target)) return;
    event.preventDefault();
    paste(event.clipboardData.getData("text/plain"));
  });
  listeners.push(() => drop());
}

/* The clipboard must be filled at once: what is selected was asked for when it was selected. */
let clipping = "";
function clip(event, cut) {
  if (typing(event.target) || !clipping || String(getSelection())) return;
  event.preventDefault();
  event.clipboardData.setData("text/plain", clipping);
  if (cut) removeChosen();
}

/* The schematic: what is selected in it, what a problem marks, and how one looks for ends and lines near the pointer. */
const NEAR = { open: 11, joined: 5, optional: 6 }, OVER = 6;
// pixels around an end that belong to it; over a part, fewer
const SMALLEST = 0.5; // scale below which the picture is moved instead: names are 7 pixels high there

const drawing = () => at("sheet").querySelector("svg");
const partAt = (name) => [...at("sheet").querySelectorAll(".part")].find((one) => one.dataset.part === name);
const endAt = (path) => [...at("sheet").querySelectorAll(".end")].find((one) => one.dataset.end === path);

function draw(picture) {
  const sheet = at("sheet"), active = document.activeElement, focused = active?.dataset;
  const place = focused?.part ?? focused?.end;
  if (!picture) {
    sheet.replaceChildren(element("div", { className: "empty" }, element("strong", {}, "An empty sheet"),
      element("span", {}, "Find a part on the left, click it, and click here. Parts go onto lines, onto ends, or anywhere.")));
    return;
  }
  const made = new DOMParser().parseFromString(picture, "image/svg+xml").documentElement;
  made.style.minWidth = `${SMALLEST * made.viewBox.baseVal.width}px`;
  sheet.replaceChildren(document.adoptNode(made));
  if (place && sheet.contains(active) === false &&
    focused) (partAt(place) ?? endAt(place))?.focus({ preventScroll: true });
  mark();
}

/* Classes of what is selected, and of parts with problems. */
function mark() {
  const wrong = new Map(page.problems.map((one) => [placeOf(one).part, one.kind === "note" ? "noted" : "wrong"]));
  for (const part of at("sheet").querySelectorAll(".part")) {
    const name = part.dataset.part;
    part.classList.toggle("selected", page.selected.has(name));
    part.classList.toggle("wrong", wrong.get(head(name)) === "wrong");
    part.setAttribute("aria-pressed", page.selected.has(name));
  }
  for (const wire of at("sheet").querySelectorAll(".wire"))
    wire.classList.toggle("selected", wire.dataset.ends === page.line?.join(" "));
  at("sheet").classList.toggle("stale", !page.valid);
}

function select(names, line = null) {
  page.selected = new Set(names);
  page.line = line;
  mark();
  inspect();
  if (names.length === 1) scrollTo(head(names[0]));
}

/* What a pointer means: an end nearby, or else a part, or a line, or the sheet. */
function meant(event) {
  const stack = document.elementsFromPoint(event.clientX, event.clientY);
  const behind = stack.find((one) => one.matches(".wire"));
  const target = stack[0], over = target?.closest(".part") &&
    !target.closest(".end");
  let best = null, nearest = over ? OVER : Infinity;
  for (const end of at("sheet").querySelectorAll(".end")) {
    const box = end.getBoundingClientRect();
    const away = Math.hypot(event.clientX - box.x - box.width / 2, event.clientY - box.y - box.height / 2);
    if (away < Math.min(nearest, NEAR[end.classList[1]]) && shownEnd(end, over)) [best, nearest] = [end, away];
  }
  if (best) return { end: best.dataset.ground && event.altKey ? best.dataset.ground : best.dataset.end, node: best };
  // The room of a part, for its name, is wider than its symbol, and lies over lines.
  const part = target?.matches(".hold") && behind ? null : target?.closest(".part"), wire = part ? null : behind;
  if (part) return { part: part.dataset.part, node: part };
  if (wire) return { line: wire.dataset.ends.split(" "), node: wire };
  return target?.closest("#sheet") ? { sheet: true, node: at("sheet") } : {};
}

/* Optional ends are there for selected parts, and while something is carried or joined; over its part a joined one, too:
 * a thin part would otherwise be all ends. */
const shownEnd = (end, over) => !(end.classList.contains("optional") || over && end.classList.contains("joined"))
  || end.closest(".part").classList.contains("selected") || !!end.closest(".joining, .carrying");

/* Of a line with many ends, the two between which a part is inserted: the one next to the pointer, and another. */
function between(line, event) {
  const places = line.map((path) => {
    const box = endAt(path)?.getBoundingClientRect();
    return { path, away: box ? Math.hypot(box.x - (event?.clientX ?? 0), box.y - (event?.clientY ?? 0)) : 1e9 };
  });
  places.sort((a, b) => a.away - b.away);
  return [places[0].path, places[1]?.path ?? places[0].path];
}

/* The next part in a direction, for the arrow keys. */
function neighbour(name, key) {
  const middle = (one) => { const box = one.getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2]; };
  const all = [...at("sheet").querySelectorAll(".part")], from = partAt(name) ?? all[0];
  if (!from) return null;
  const [x, y] = middle(from), [dx, dy] = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0,
    1] }[key];
  const rated = all.filter((one) => one !== from).map((one) => {
    const [u, v] = middle(one), along = (u - x) * dx + (v - y) * dy,
      across = Math.abs((u - x) * dy) + Math.abs((v - y) * dx);
    return [along > 1 ? along + 2 * across : 1e9, one];
  }).sort((a, b) => a[0] - b[0]);
  return rated.length && rated[0][0] < 1e9 ? rated[0][1] : null;
}

listeners.push(() => draw(page.picture));

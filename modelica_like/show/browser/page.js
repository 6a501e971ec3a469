/* A drive as a page. PAGE (see page.py) has the compiled run-time, the model, what can be set and what can be shown. */
const PAGE = JSON.parse(document.getElementById("page").textContent);
const MODES = PAGE.modes.filter((one) => one.names); // the others are discrete values
const MOST_MARKS = 40, MOST_KEPT = 5; // more events are not marked; earlier runs that stay drawn
const at = (id) => document.getElementById(id);
const escaped = (text) => text.replace(/[&<>"]/g, (letter) => `&#${letter.charCodeAt(0)};`);

/* ---- controls: values are in the shown unit, positions from 0 to 1 ---- */

function grouped(list, key) {
  const groups = new Map();
  for (const one of list) groups.set(key(one), [...(groups.get(key(one)) ?? []), one]);
  return groups;
}

const valueAt = (one, p) => one.log ? one.low * (one.high / one.low) ** p : one.low + p * (one.high - one.low);
const positionOf = (one, value) =>
  one.log ? Math.log(value / one.low) / Math.log(one.high / one.low) : (value - one.low) / (one.high - one.low);

function control(one) {
  const range = element("input", { type: "range", min: 0, max: 1, step: "any", ariaLabel: one.name });
  const number = element("input", { type: "number", step: "any", ariaLabel: `${one.name} in ${one.unit}` });
  const title = [one.name, one.description].filter(Boolean).join(": ");
  const label = element("label", { title }, one.name.slice(one.group ? one.group.length + 1 : 0));
  const row = element("div", { className: "control" }, label, number, element("span", {}, one.unit), range);
  one.put = (value, from) => {
    one.now = value;
    if (from !== range) range.value = positionOf(one, value);
    if (from !== number) number.value = short(value, 7);
    row.classList.toggle("changed", value !== one.value);
    ask();
  };
  range.oninput = () => one.put(Number(valueAt(one, range.valueAsNumber).toPrecision(5)), range);
  range.ondblclick = () => one.put(one.value);
  number.oninput = () => number.value === "" || one.put(number.valueAsNumber, number);
  one.put(one.value);
  return row;
}

/* The drive's own parameters stand open; those of parts under the parts' names. */
function controls() {
  const panel = at("top").parentNode, groups = grouped(PAGE.sliders, (one) => one.group);
  panel.append(...groups.get("").map(control));
  groups.delete("");
  for (const [name, members] of groups)
    panel.append(element("details", { open: groups.size < 3 }, element("summary", {}, name), ...members.map(control)));
}

/* ---- pictures ---- */

const LEFT = 58, RIGHT = 14, TOP = 6, BOTTOM = 20, HEIGHT = 165, ROW = 36, COLOURS = 7;

const OPERATIONS = { "+": (a, b) => a + b, "-": (a, b) => a - b, "*": (a, b) => a * b, "/": (a, b) => a / b,
  "**": (a, b) => a ** b, neg: (a) => -a };
const used = (one) => one.references ?? [one.reference];

/* The value of a formula, as page.py writes it; `read` returns what stands at a place. */
function valueOf(tree, read) {
  if (typeof tree === "number") return tree;
  const [first, ...operands] = tree;
  if (operands.length === 0) return read(first);
  return (OPERATIONS[first] ?? Math[first])(...operands.map((one) => valueOf(one, read)));
}

/* What a run has for a variable or a formula, in its shown unit. */
function values(result, variable) {
  const width = result.references.length, columns = used(variable).map((one) => result.references.indexOf(one));
  if (columns.includes(-1)) return []; // nobody asked for it then
  const unit = PAGE.units[variable.unit], at = (k, n) => n < 0 ? result.times[k] : result.outputs[k * width + columns[n]];
  const own = variable.tree ? (_, k) => valueOf(variable.tree, (n) => at(k, n)) : (_, k) => at(k, 0);
  return result.times.map(own).map((value) => variable.driving * (value - unit.offset) / unit.factor);
}

function range(curves) {
  let [low, high] = [Infinity, -Infinity];
  for (const curve of curves)
    for (const value of curve) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
  return low <= high ? [low, high] : [0, 1];
}

class Picture {
  constructor(result, earlier) {
    Object.assign(this, { result, earlier, times: result.times, end: until.now, width: at("curves").clientWidth });
    this.x = (t) => LEFT + (t / this.end) * (this.width - LEFT - RIGHT);
    const instants = new Map();
    for (let k = 0; k < result.events.length; k += 7) {
      const mode = PAGE.modes[result.events[k + 2]];
      if (mode) instants.set(result.events[k], `${mode.name}: ${mode.names[result.events[k + 4]]}`);
    }
    this.instants = [...instants];
    this.draw();
  }

  svg(height, inside) {
    const upright = (t, kind) =>
      `<line class="${kind}" x1="${this.x(t)}" x2="${this.x(t)}" y1="${TOP}" y2="${height - BOTTOM}"/>`;
    const steps = ticks(0, this.end, this.width / 110).map((t) => upright(t, "grid") +
      `<text x="${this.x(t)}" y="${height - 6}" text-anchor="${t === 0 ? "start" : "middle"}">${short(t)} s</text>`);
    const marks = this.instants.length > MOST_MARKS ? [] : this.instants.map(([t]) => upright(t, "event"));
    const all = [...steps, ...marks, inside, upright(0, "cursor")].join("");
    return `<svg viewBox="0 0 ${this.width} ${height}">${all}</svg>`;
  }

  path(times, curve, y, attributes) {
    let line = "", pen = "M";
    for (let k = 0; k < curve.length && times[k] <= this.end; k++) {
      if (Number.isFinite(curve[k])) line += `${pen}${this.x(times[k]).toFixed(1)} ${y(curve[k]).toFixed(1)}`;
      pen = Number.isFinite(curve[k]) ? "L" : "M";
    }
    return `<path d="${line}" ${attributes}/>`;
  }

  panel(variables) {
    const unit = PAGE.units[variables[0].unit], stroke = (k) => `stroke="var(--c${k % COLOURS})"`;
    const curves = variables.map((one) => values(this.result, one));
    const before = this.earlier.map((run) => variables.map((one) => values(run, one)));
    let [low, high] = range([...curves, ...before.flat()]);
    const margin = 0.05 * (high - low) || 0.1 * Math.abs(high) || 1;
    [low, high] = [low - margin, high + margin];
    const y = (value) => TOP + ((high - value) / (high - low)) * (HEIGHT - TOP - BOTTOM);
    const grid = ticks(low, high, 5).map((value) =>
      `<line class="grid" x1="${LEFT}" x2="${this.width - RIGHT}" y1="${y(value)}" y2="${y(value)}"/>` +
      `<text x="${LEFT - 6}" y="${y(value) + 4}" text-anchor="end">${short(value)}</text>`);
    const paths = [
      ...before.flatMap((curves, run) =>
        curves.map((one, k) => this.path(this.earlier[run].times, one, y, `class="before" ${stroke(k)}`))),
      ...curves.map((one, k) => this.path(this.times, one, y, `class="${k < COLOURS ? "" : "more"}" ${stroke(k)}`))];
    const legend = variables.map((one, k) => {
      const value = element("b"), mark = element("i");
      mark.style.background = `var(--c${k % COLOURS})`;
      this.readers.push((n) => value.textContent = n === null ? "" : `\u2002${short(curves[k][n])}`);
      const about = { title: `${one.description || one.name}; a click takes it away` };
      about.onclick = () => (shown.delete(one), ask());
      return element("button", about, mark, one.driving < 0 ? `\u2212${one.name}` : one.name, value);
    });
    const title = element("span", {}, [unit.quantity, unit.text].filter(Boolean).join(" in "));
    const made = element("figure", { innerHTML: this.svg(HEIGHT, grid.join("") + paths.join("")) });
    made.prepend(element("figcaption", {}, title, ...legend));
    return made;
  }

  /* Modes that change as bands, one row each. */
  bands() {
    const curves = MODES.map((mode) => [mode, values(this.result, mode)]);
    const rows = curves.filter(([, curve]) => curve.some((one) => one !== curve[0])).map(([mode, curve], row) => {
      const top = TOP + row * ROW + 14;
      let pieces = "", first = 0;
      for (let k = 1; k < curve.length; k++) {
        const [x, next] = [this.x(this.times[first]), this.x(this.times[k])], last = k + 1 === curve.length;
        if (!last && (curve[k] === curve[first] || next - x < 0.4)) continue;
        const name = escaped(mode.names[curve[first]]), colour = `var(--c${curve[first] % COLOURS})`;
        pieces += `<rect class="band" x="${x}" y="${top}" width="${next - x}" height="18" fill="${colour}"/>`;
        if (next - x > 7 * name.length) pieces += `<text class="name" x="${x + 4}" y="${top + 13}">${name}</text>`;
        first = k;
      }
      this.modes.push((n) => `${mode.name} ${mode.names[curve[n]]}`);
      return `<text x="${LEFT}" y="${top - 3}">${escaped(mode.name)}</text>${pieces}`;
    });
    return element("figure", { innerHTML: rows.length && this.svg(TOP + BOTTOM + rows.length * ROW, rows.join("")) });
  }

  draw() {
    [this.readers, this.modes] = [[], []];
    const figures = [...grouped(shown, (one) => one.unit).values()].map((one) => this.panel(one));
    at("curves").replaceChildren(...figures, this.bands());
  }

  /* Values at a place of the pointer in the page; null: it has left. */
  read(place) {
    const left = at("curves").getBoundingClientRect().left;
    const t = place === null ? NaN : ((place - left - LEFT) / (this.width - LEFT - RIGHT)) * this.end;
    let n = t >= 0 && t <= this.times.at(-1) ? this.times.findIndex((one) => one >= t) : null;
    if (n > 0 && t - this.times[n - 1] < this.times[n] - t) n -= 1;
    this.readers.forEach((one) => one(n));
    const x = n === null ? 0 : this.x(this.times[n]);
    at("curves").style = `--x: ${x - LEFT}px; --cursor: ${n === null ? "hidden" : "visible"}`;
    const near = n === null ? [] : this.instants.filter(([time]) => Math.abs(this.x(time) - x) < 3);
    at("readout").textContent = n === null ? "" : [`t = ${short(this.times[n])} s`, ...this.modes.map((one) => one(n)),
      ...near.slice(-1).map(([time, what]) => `event at ${short(time)} s: ${what}`)].join(" · ");
  }
}

/* ---- what is asked for, and what comes ---- */

const until = PAGE.sliders.find((one) => one.reference === null);
const shown = new Set(PAGE.variables.filter((one) => one.shown));
let drive = null, picture = null, original = null, turn = 0, waiting = false, kept = [];

function ask() {
  turn += 1;
  if (drive === null || waiting) return;
  waiting = true;
  requestAnimationFrame(() => (waiting = false, update().catch(tell)));
}

const tell = (error) => at("said").textContent = `The page has failed: ${error.message}`;

async function update() {
  const mine = turn, wanted = () => mine === turn, begin = performance.now();
  const references = [...new Set([...shown, ...MODES].flatMap(used))];
  const changed = PAGE.sliders.filter((one) => one.reference !== null && one.now !== one.value);
  if (references.join() !== original?.references.join()) original = null;
  const given = changed.map((one) => [one.reference, one.now * one.factor + one.offset]);
  const result = await drive.simulate(given, references, until.now, wanted);
  if (result === null) return;
  const computed = performance.now();
  if (original === null) original = changed.length ? await drive.simulate([], references, PAGE.until, wanted) : result;
  if (!wanted()) return;
  at("said").textContent = result.message;
  at("curves").classList.toggle("stale", result.times.length < 2);
  if (result.times.length >= 2) picture = new Picture(result, [...(changed.length ? [original] : []), ...kept]);
  const events = result.events.length / 7, drawn = performance.now();
  at("status").textContent = `${result.steps} steps, ${events} mode change${events === 1 ? "" : "s"}; the run took ` +
    `${(computed - begin).toFixed(1)} ms, the picture ${(drawn - computed).toFixed(1)} ms. Made by ${PAGE.tool}.`;
  Object.assign(at("status").dataset, { turn: mine, run: computed - begin, draw: drawn - computed });
  document.dispatchEvent(new Event("drawn"));
}

async function begin() {
  drive = await openDrive();
  ask();
}

function listen() {
  at("add").placeholder = `add one of ${PAGE.variables.length - shown.size} more curves …`;
  at("names").append(...PAGE.variables.map((one) => element("option", { value: one.name })));
  at("add").onchange = () => {
    const found = PAGE.variables.find((one) => one.name === at("add").value);
    if (found === undefined) return;
    at("add").value = "";
    shown.add(found);
    ask();
  };
  at("reset").onclick = () => (kept = [], PAGE.sliders.forEach((one) => one.put(one.value)));
  at("keep").onclick = () => (kept = [...kept, picture.result].slice(-MOST_KEPT), ask());
  at("curves").onpointermove = (event) => picture?.read(event.clientX);
  at("curves").onpointerleave = () => picture?.read(null);
  new ResizeObserver(() => picture && picture.width !== at("curves").clientWidth && ask()).observe(at("curves"));
}

controls();
listen();
begin().catch(tell);

/* Curves over time, by unit, with events and bands of modes: for all pages in which a drive runs.

A run has times, outputs (of references, row by row), events (rows of seven numbers) and the content that page.py gives:
variables, modes and units. A run of measured values has its curves by the names of variables instead. */
const MOST_MARKS = 40; // more events are not marked
const at = (id) => document.getElementById(id);
const escaped = (text) => text.replace(/[&<>"]/g, (letter) => `&#${letter.charCodeAt(0)};`);

function grouped(list, key) {
  const groups = new Map();
  for (const one of list) groups.set(key(one), [...(groups.get(key(one)) ?? []), one]);
  return groups;
}

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

/* What a run has for a variable or a formula, in its shown unit; nothing, if nobody asked for it then. */
function values(run, variable) {
  if (run.own) return run.own.get(variable.name) ?? [];
  const known = variable.mode ? variable : run.content.variables.find((one) => one.name === variable.name);
  const width = run.references.length, columns = known ? used(known).map((one) => run.references.indexOf(one)) : [-1];
  if (columns.includes(-1)) return [];
  const unit = run.content.units[known.unit], at = (k, n) => n < 0 ? run.times[k] : run.outputs[k * width + columns[n]];
  const own = known.tree ? (_, k) => valueOf(known.tree, (n) => at(k, n)) : (_, k) => at(k, 0);
  return run.times.map(own).map((value) => known.driving * (value - unit.offset) / unit.factor);
}

const modesOf = (content) => content.modes.filter((one) => one.names).map((one) => ({ ...one, mode: true }));

function range(curves) {
  let [low, high] = [Infinity, -Infinity];
  for (const curve of curves)
    for (const value of curve) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
  return low <= high ? [low, high] : [0, 1];
}

class Picture {
  /* Draws a run into an element, and earlier ones as thin lines; `remove` takes a curve away, `choose` a time. */
  constructor(place, run, earlier, { shown, end, remove, choose }) {
    Object.assign(this, { place, run, earlier, times: run.times, end, shown, remove, width: place.clientWidth });
    this.x = (t) => LEFT + (t / this.end) * (this.width - LEFT - RIGHT);
    const instants = new Map();
    for (let k = 0; k < run.events.length; k += 7) {
      const mode = run.content.modes[run.events[k + 2]];
      if (mode) instants.set(run.events[k], `${mode.name}: ${mode.names?.[run.events[k + 4]] ?? ""}`);
    }
    this.instants = [...instants];
    place.onpointermove = (event) => this.read(event.clientX);
    place.onpointerleave = () => this.read(null);
    place.onclick = (event) => !event.target.closest("button") && this.inside(event.clientX) &&
      choose?.(this.time(event.clientX));
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
    const unit = this.run.content.units[variables[0].unit], stroke = (k) => `stroke="var(--c${k % COLOURS})"`;
    const curves = variables.map((one) => values(this.run, one));
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
      about.onclick = () => this.remove(one);
      return element("button", about, mark, one.driving < 0 ? `\u2212${one.name}` : one.name, value);
    });
    const title = element("span", {}, [unit.quantity, unit.text].filter(Boolean).join(" in "));
    const made = element("figure", { innerHTML: this.svg(HEIGHT, grid.join("") + paths.join("")) });
    made.prepend(element("figcaption", {}, title, ...legend));
    return made;
  }

  /* Modes that change as bands, one row each. */
  bands() {
    const curves = modesOf(this.run.content).map((mode) => [mode, values(this.run, mode)]);
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
    const figures = [...grouped(this.shown, (one) => one.unit).values()].map((one) => this.panel(one));
    this.place.replaceChildren(...figures, this.bands());
  }

  time(place) {
    return ((place - this.place.getBoundingClientRect().left - LEFT) / (this.width - LEFT - RIGHT)) * this.end;
  }

  inside(place) {
    const t = this.time(place);
    return t >= 0 && t <= this.times.at(-1);
  }

  readAt(t) {
    this.read(this.place.getBoundingClientRect().left + this.x(t));
  }

  /* Values at a place of the pointer in the page; null: it has left. */
  read(place) {
    const t = place === null ? NaN : this.time(place);
    let n = t >= 0 && t <= this.times.at(-1) ? this.times.findIndex((one) => one >= t) : null;
    if (n > 0 && t - this.times[n - 1] < this.times[n] - t) n -= 1;
    this.readers.forEach((one) => one(n));
    const x = n === null ? 0 : this.x(this.times[n]);
    this.place.style = `--x: ${x - LEFT}px; --cursor: ${n === null ? "hidden" : "visible"}`;
    const near = n === null ? [] : this.instants.filter(([time]) => Math.abs(this.x(time) - x) < 3);
    at("readout").textContent = n === null ? "" : [`t = ${short(this.times[n])} s`, ...this.modes.map((one) => one(n)),
      ...near.slice(-1).map(([time, what]) => `event at ${short(time)} s: ${what}`)].join(" · ");
  }
}


/* The curves of a report: panels with one time axis, modes as bands below. DATA is what curves.py returns. */
const DATA = JSON.parse(document.getElementById("data").textContent);
const LEFT = 64, RIGHT = 12, TOP = 8, BOTTOM = 22, HEIGHT = 190, ROW = 22, COLOURS = 8, MOST_MARKS = 80;
const whole = [DATA.times[0], DATA.times.at(-1)];
const view = { low: whole[0], high: whole[1], at: null, from: null };
const root = document.getElementById("curves");
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`);

/* Returns the position of the last result that is not after t. */
function before(t) {
  let [low, high] = [0, DATA.times.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (DATA.times[middle] <= t) low = middle; else high = middle - 1;
  }
  return low;
}

function valueAt(values, t) {
  const k = before(t), [a, b] = [DATA.times[k], DATA.times[k + 1]];
  return b > a ? values[k] + ((t - a) / (b - a)) * (values[k + 1] - values[k]) : values[k];
}

class Panel {
  constructor(title, height) {
    this.height = height;
    this.canvas = element("canvas", { height, ariaLabel: title, role: "img" });
    this.legend = element("div", { className: "legend" });
    root.append(element("div", { className: "panel" }, this.legend, this.canvas));
    this.canvas.onpointermove = (event) => { view.at = this.time(event); drawAll(); };
    this.canvas.onpointerleave = () => { view.at = null; drawAll(); };
    this.canvas.onpointerdown = (event) => { view.from = this.time(event); this.canvas.setPointerCapture(event.pointerId); };
    this.canvas.onpointerup = (event) => {
      const [low, high] = [view.from, this.time(event)].sort((a, b) => a - b);
      view.from = null;
      if ((high - low) / (view.high - view.low) > 0.01) Object.assign(view, { low, high });
      drawAll();
    };
    this.canvas.ondblclick = () => { Object.assign(view, { low: whole[0], high: whole[1] }); drawAll(); };
  }

  time(event) {
    const x = event.clientX - this.canvas.getBoundingClientRect().left;
    const t = view.low + ((x - LEFT) / (this.width - LEFT - RIGHT)) * (view.high - view.low);
    return Math.min(Math.max(t, view.low), view.high);
  }

  x(t) { return LEFT + ((t - view.low) / (view.high - view.low)) * (this.width - LEFT - RIGHT); }

  draw() {
    const ratio = devicePixelRatio || 1, c = this.canvas.getContext("2d");
    this.width = this.canvas.clientWidth;
    [this.canvas.width, this.canvas.height] = [this.width * ratio, this.height * ratio];
    this.canvas.style.height = `${this.height}px`;
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.font = "12px system-ui, Helvetica, Arial, sans-serif";
    const bottom = this.height - BOTTOM, steps = ticks(view.low, view.high, this.width / 110);
    for (const t of steps) this.line(c, t, bottom, "rule");
    c.fillStyle = colour("grey");
    for (const t of steps) {
      c.textAlign = this.x(t) > this.width - 2 * RIGHT ? "right" : "center";
      c.fillText(`${short(t)} s`, this.x(t), this.height - 6);
    }
    this.inside(c, bottom);
    const marks = DATA.events.filter((t) => t >= view.low && t <= view.high);
    if (marks.length <= MOST_MARKS) for (const t of marks) this.line(c, t, bottom, "grey", [2, 4]);
    if (view.at !== null) this.line(c, view.at, bottom, "ink");
    if (view.from !== null && view.at !== null) {
      c.fillStyle = colour("rule");
      c.globalAlpha = 0.5;
      c.fillRect(this.x(view.from), TOP, this.x(view.at) - this.x(view.from), bottom - TOP);
      c.globalAlpha = 1;
    }
  }

  line(c, t, bottom, name, dashes = []) {
    c.beginPath();
    c.setLineDash(dashes);
    [c.strokeStyle, c.lineWidth] = [colour(name), 1];
    c.moveTo(this.x(t), TOP);
    c.lineTo(this.x(t), bottom);
    c.stroke();
    c.setLineDash([]);
  }
}

class Curves extends Panel {
  constructor(panel) {
    super(panel.title, HEIGHT);
    this.panel = panel;
    this.outputs = panel.curves.map((curve, k) => {
      const output = element("output", {}), name = element("span", {}, "▬ ");
      name.style.color = `var(--c${k % COLOURS})`;
      this.legend.append(element("span", {}, name, curve.name, " ", output));
      return output;
    });
    this.legend.prepend(element("b", {}, panel.title));
  }

  inside(c, bottom) {
    const first = before(view.low), last = Math.min(before(view.high) + 1, DATA.times.length - 1);
    let [low, high] = [Infinity, -Infinity];
    for (const { values } of this.panel.curves)
      for (let k = first; k <= last; k++) [low, high] = [Math.min(low, values[k]), Math.max(high, values[k])];
    const room = (high - low || Math.abs(high) || 1) * 0.05, y = (value) =>
      bottom - ((value - low + room) / (high - low + 2 * room)) * (bottom - TOP);
    c.textAlign = "right";
    for (const value of ticks(low - room, high + room, 4)) {
      c.fillStyle = colour("grey");
      c.fillText(short(value), LEFT - 8, y(value) + 4);
      c.fillStyle = colour("rule");
      c.fillRect(LEFT, y(value), this.width - LEFT - RIGHT, 1);
    }
    c.save();
    c.beginPath();
    c.rect(LEFT, 0, this.width - LEFT - RIGHT, this.height);
    c.clip();
    this.panel.curves.forEach(({ values }, n) => {
      c.beginPath();
      [c.strokeStyle, c.lineWidth, c.lineJoin] = [colour(`c${n % COLOURS}`), 1.6, "round"];
      for (let k = first; k <= last; k++) c.lineTo(this.x(DATA.times[k]), y(values[k]));
      c.stroke();
      this.outputs[n].textContent = view.at === null ? "" : short(valueAt(values, view.at));
    });
    c.restore();
  }
}

class Modes extends Panel {
  constructor(modes) {
    super("modes", TOP + BOTTOM + ROW * modes.length);
    this.modes = modes;
    this.clock = element("output", {});
    this.legend.append(element("b", {}, "modes"), this.clock);
  }

  inside(c, bottom) {
    this.modes.forEach(({ name, bands }, row) => {
      const names = [...new Set(bands.map((band) => band[2]))], top = TOP + ROW * row;
      for (const [begin, end, mode] of bands) {
        if (end < view.low || begin > view.high) continue;
        const west = Math.max(this.x(begin), LEFT), wide = Math.min(this.x(end), this.width - RIGHT) - west;
        c.fillStyle = colour(`c${names.indexOf(mode) % COLOURS}`);
        c.globalAlpha = 0.22;
        c.fillRect(west, top + 1, wide, ROW - 3);
        c.globalAlpha = 1;
        c.fillStyle = colour("ink");
        c.textAlign = "left";
        const text = `${name}: ${mode}`;
        if (c.measureText(text).width < wide - 8) c.fillText(text, west + 5, top + ROW - 8);
        else if (c.measureText(mode).width < wide - 8) c.fillText(mode, west + 5, top + ROW - 8);
      }
    });
    this.clock.textContent = view.at === null ? "" : `t = ${short(view.at)} s: ` + this.modes.map(({ name, bands }) =>
      `${name} ${(bands.find((band) => view.at < band[1]) ?? bands.at(-1))[2]}`).join(", ");
  }
}

const panels = DATA.panels.map((panel) => new Curves(panel));
if (DATA.modes.length > 0) panels.push(new Modes(DATA.modes));
function drawAll() { for (const panel of panels) panel.draw(); }
addEventListener("resize", drawAll);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);
drawAll();
document.documentElement.dataset.ready = "yes";

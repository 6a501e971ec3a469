/* A drive as a page. PAGE (see page.py) has the compiled run-time, the model, what can be set and what can be shown. */
const PAGE = JSON.parse(document.getElementById("page").textContent);
const MODES = modesOf(PAGE);
const MOST_KEPT = 5; // earlier runs that stay drawn

/* ---- controls: values are in the shown unit, positions from 0 to 1 ---- */

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
  result.content = original.content = PAGE;
  const options = { shown: [...shown], end: until.now, remove: (one) => (shown.delete(one), ask()) };
  const before = [...(changed.length ? [original] : []), ...kept];
  if (result.times.length >= 2) picture = new Picture(at("curves"), result, before, options);
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
  at("keep").onclick = () => (kept = [...kept, picture.run].slice(-MOST_KEPT), ask());
  new ResizeObserver(() => picture && picture.width !== at("curves").clientWidth && ask()).observe(at("curves"));
}

controls();
listen();
begin().catch(tell);

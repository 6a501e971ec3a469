/* Runs that were kept, side by side, and measured values laid over the curves. */
const kept = []; // { name, run, on, about, file, shift }
let difference = false;

/* What is drawn: the present run and others; or, instead, how much the others differ from it. */
function compared() {
  const others = [...kept.filter((one) => one.on).map((one) => one.run)];
  if (!difference || !others.length) return { main: results.run, others: [...others, ...(kept.some((one) =>
    one.on) ? [] : results.earlier)] };
  const less = others.map((run) => ({ times: results.run.times, own: new Map(wanted().map((one) => [one.name,
    minus(run, one)])) }));
  return { main: { ...results.run, own: less[0].own }, others: less.slice(1) };
}

/* The values of a run less those of the present one, at its times. */
function minus(run, variable) {
  const theirs = values(run, variable), mine = values(results.run, variable),
    answer = new Float64Array(mine.length).fill(NaN);
  for (let k = 0, n = 0; k < mine.length && theirs.length; k++) {
    const time = results.run.times[k];
    while (n + 2 < run.times.length && run.times[n + 1] < time) n++;
    const [a, b] = [run.times[n], run.times[n + 1]], part = b > a ? Math.min(Math.max((time - a) / (b - a), 0), 1) : 0;
    if (time >= run.times[0] &&
      time <= run.times.at(-1)) answer[k] = theirs[n] + part * (theirs[n + 1] - theirs[n]) - mine[k];
  }
  return answer;
}

function listRuns() {
  const rows = kept.map((one) => {
    const box = element("input", { type: "checkbox", checked: one.on, ariaLabel: `draw ${one.name}` });
    box.onchange = () => { one.on = box.checked; drawCurves(); };
    const remove = element("button", { className: "quiet", ariaLabel: `Remove ${one.name}` }, "×");
    remove.onclick = () => { kept.splice(kept.indexOf(one), 1); listRuns(); drawCurves(); };
    const more = one.columns ? [element("button", { className: "quiet" }, "Columns …")] : [];
    if (more.length) more[0].onclick = () => columnsOf(one);
    return element("span", { className: "kept", title: one.about }, element("label", {}, box, one.name), ...more,
      remove);
  });
  if (kept.length) {
    const box = element("input", { type: "checkbox", checked: difference });
    box.onchange = () => { difference = box.checked; drawCurves(); };
    rows.push(element("label", { className: "difference" }, box, "only differences"));
  }
  at("runs").replaceChildren(...rows);
}

async function keepRun() {
  if (!results.run) return;
  const about = [...results.given].map(([path, value]) => `${path} = ${short(value)}`).join(", ");
  const answer = await question("Keep this run", [{ name: "name", label: "Name", value: about ||
    `run ${kept.length + 1}` }], "Keep");
  if (!answer?.name) return;
  kept.push({ name: answer.name, run: results.run, on: true, about: about || `revision ${page.revision}` });
  listRuns();
  drawCurves();
}

/* ---- measured values ---- */

/* A table as a spreadsheet writes it: commas, or semicolons or tabs with decimal commas. */
function readCsv(text) {
  const lines = text.replace(/^\uFEFF/, "").split(/\r?\n/).filter((line) => line.trim() && !line.startsWith("#"));
  const mark = ["\t", ";", ","].find((one) => lines[0]?.includes(one)) ?? ",", rows = lines.map((line) =>
    line.split(mark).map((cell) => cell.trim().replace(/^"|"$/g, "")));
  const number = (cell) => cell === "" || cell === undefined ? NaN : Number(mark === "," ? cell : cell.replace(",",
    "."));
  const [titles, ...body] = rows;
  if (!titles || body.length < 2) throw new Error("The table has less than two rows of numbers.");
  return titles.map((title, k) => ({ title, name: title.replace(/\s*\[.*\]$/, ""),
    unit: /\[(.*)\]/.exec(title)?.[1] ?? "", values: body.map((row) => number(row[k])) }));
}

async function measured(file) {
  let columns;
  try { columns = readCsv(await file.text()); } catch (error) { return tell(error); }
  const first = columns.find((one) => /^(t|time|zeit)$/i.test(one.name)) ?? columns[0];
  const one = { name: file.name, on: true, about: "measured values", columns, time: first, shift: 0, factor: 1,
    pairs: new Map() };
  for (const column of columns) if (results.content?.variables.some((known) =>
    known.name === column.name)) one.pairs.set(column.name, { column, factor: 1 });
  arranged(one);
  kept.push(one);
  listRuns();
  drawCurves();
  if (!one.pairs.size) columnsOf(one);
  else for (const name of one.pairs.keys()) if (!results.shown.includes(name)) toggleCurve(name);
}

function arranged(one) {
  const times = one.time.values.map((value) => value * one.factor + one.shift), order = times.map((_, k) =>
    k).filter((k) => Number.isFinite(times[k])).sort((a, b) => times[a] - times[b]);
  one.run = { times: Float64Array.from(order, (k) => times[k]), own: new Map([...one.pairs].map(([name, { column,
    factor }]) => [name, Float64Array.from(order, (k) => column.values[k] * factor)])) };
}

/* Which column is which variable, in what unit, and how time is shifted; handed to calibrate as Python. */
async function columnsOf(one) {
  const titles = one.columns.map((column) => column.title), shownNames = results.shown, none = "—";
  const pair = [...one.pairs], fields = [{ name: "time", label: "Time", choices: titles, value: one.time.title },
    { name: "factor", label: "Seconds per unit of time", value: String(one.factor) },
    { name: "shift", label: "Shift in s", value: String(one.shift) },
    ...shownNames.flatMap((name) => {
      const mine = pair.find(([key]) => key === name)?.[1],
        unit = results.content.units[results.content.variables.find((v) => v.name === name)?.unit]?.text || "1";
      return [{ name: `c:${name}`, label: name, choices: [none, ...titles], value: mine?.column.title ?? none },
        { name: `f:${name}`, label: `${name}: ${unit} per unit of the column`, value: String(mine?.factor ?? 1) }];
    })];
  const names = [...one.pairs.values()].map(({ column }) => column.title).join(", ") || "…";
  const about = `For calibrate: Trajectories("${one.name}") with the columns ${names}, in calibrate("${page.file}", [measured], {"part.value": (low, high)}).`;
  const answer = await question(`Columns of ${one.name}`, fields, "Draw", about);
  if (!answer) return;
  Object.assign(one, { time: one.columns.find((column) => column.title === answer.time),
    factor: Number(answer.factor) || 1, shift: Number(answer.shift) || 0 });
  one.pairs = new Map(shownNames.filter((name) => answer[`c:${name}`] !== none).map((name) => [name,
    { column: one.columns.find((column) => column.title === answer[`c:${name}`]),
      factor: Number(answer[`f:${name}`]) || 1 }]));
  arranged(one);
  drawCurves();
}

function listenToRuns() {
  at("keep").onclick = keepRun;
  at("measure").onclick = () => at("csv").click();
  at("csv").onchange = () => { if (at("csv").files[0]) measured(at("csv").files[0]); at("csv").value = ""; };
  at("add").onchange = () => { const name = at("add").value.trim(); at("add").value = "";
  if (name && results.content && !results.shown.includes(name)) toggleCurve(name); };
  at("until").onchange = () => put("until",
    /^[\d.e+-]+$/.test(at("until").value) ? `${at("until").value} s` : at("until").value,
      { section: "simulate" }).then((why) => why && tell(new Error(why)));
  at("show-clock").onclick = () => playing.on ? leave() : instant(0);
  at("play").onclick = play;
  at("leave").onclick = leave;
  at("moment").oninput = () => instant(at("moment").valueAsNumber);
  at("bars").ontoggle = at("bars").querySelector("select").onchange = rank;
  at("results").ondragover = (event) => event.preventDefault();
  at("results").ondrop = (event) => {
    event.preventDefault();
    const file = event.dataTransfer.files[0], name = event.dataTransfer.getData("text/plain");
    if (file) measured(file); else if (name && !results.shown.includes(name)) toggleCurve(name);
  };
  new ResizeObserver(() => results.picture && results.picture.width !== at("curves").clientWidth &&
    drawCurves()).observe(at("curves"));
}

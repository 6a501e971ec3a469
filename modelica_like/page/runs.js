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

/* What was changed in a kept run: values of sliders, or lines that the present netlist does not have. */
function changesOf(one) {
  const now = new Set(page.text.split("\n"));
  const lines = (one.text ?? page.text).split("\n").filter((line) => line.trim() && !now.has(line));
  return [...[...one.change ?? []].map(([path, text]) => `${path} = ${text}`), ...lines].join("; ");
}

function listRuns() {
  const rows = kept.map((one) => {
    const box = element("input", { type: "checkbox", checked: one.on, ariaLabel: `draw ${one.name}` });
    box.onchange = () => { one.on = box.checked; drawCurves(); };
    const button = (text, action, about = "") => { const made = element("button", { className: "quiet",
      title: about }, text); made.onclick = () => action(one); return made; };
    const remove = () => { kept.splice(kept.indexOf(one), 1); listRuns(); drawCurves(); }, changes = changesOf(one);
    const more = one.columns ? [button("Columns …", columnsOf), button("Calibrate …", calibrateWith)]
      : changes ? [button("Take over", takeOver, "The netlist becomes that of this run")] : [];
    const off = button("×", remove);
    off.ariaLabel = `Remove ${one.name}`;
    return element("span", { className: "kept", title: [one.about, changes].filter(Boolean).join("\n") },
      element("label", {}, box, one.name), element("small", {}, changes), ...more, off);
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
  const { run, text } = results, change = new Map([...results.given].map(([path, value]) => [path,
    inUnit(results.content.sliders.find((known) => known.name === path), value)]));
  const answer = await question("Keep this run", [{ name: "name", label: "Name", value: `run ${kept.length + 1}` }],
    "Keep");
  if (!answer?.name) return;
  kept.push({ name: answer.name, run, text, change, on: true, about: "" });
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

/* The text of a file: UTF-16 or UTF-8 by its mark, or else UTF-8, or what Windows writes. */
async function textOf(file) {
  const bytes = new Uint8Array(await file.arrayBuffer()), mark = bytes[0] * 256 + bytes[1];
  const coding = { 0xfffe: "utf-16le", 0xfeff: "utf-16be" }[mark];
  if (coding) return new TextDecoder(coding).decode(bytes);
  try { return new TextDecoder("utf-8", { fatal: true }).decode(bytes); } catch {
    return new TextDecoder("windows-1252").decode(bytes);
  }
}

async function measured(file) {
  if (results.revision < 0) return say("It must be possible to run the drive before curves are laid over it.", "refused");
  try {
    const columns = readCsv(await textOf(file));
    const time = columns.find((one) => /^(t|time|zeit)$/i.test(one.name)) ?? columns[0];
    const known = columns.filter((one) => one !== time && results.content.variables.some((two) => two.name === one.name));
    const one = { name: file.name, on: true, about: "measured values", columns, time, timeUnit: time.unit, shift: 0,
      pairs: new Map(known.map((column) => [column.name, { column, unit: column.unit }])) };
    await arranged(one);
    kept.push(one);
    listRuns();
    drawCurves();
    if (!one.pairs.size) return await columnsOf(one);
    for (const name of one.pairs.keys()) if (!results.shown.includes(name)) await toggleCurve(name);
  } catch (error) { tell(error); }
}

/* Sorts rows by time; has the values in SI units, and as they are drawn: in the shown unit, with its sign. */
async function arranged(one) {
  const names = [...one.pairs.keys()], units = [["time", one.timeUnit], ...[...one.pairs].map(([name, { unit }]) => [name,
    unit])];
  const [[second, zero], ...scales] = await ask("scale", { revision: results.revision, units });
  const times = one.time.values.map((value) => value * second + zero + one.shift);
  const order = times.map((_, k) => k).filter((k) => Number.isFinite(times[k])).sort((a, b) => times[a] - times[b]);
  const column = (name, k) => order.map((n) => one.pairs.get(name).column.values[n] * scales[k][0] + scales[k][1]);
  one.measured = new Map(names.map((name, k) => [name, column(name, k)]));
  const drawn = names.map((name) => {
    const known = results.content.variables.find((two) => two.name === name), unit = results.content.units[known.unit];
    return [name, Float64Array.from(one.measured.get(name), (si) => known.driving * (si - unit.offset) / unit.factor)];
  });
  one.run = { times: Float64Array.from(order, (k) => times[k]), own: new Map(drawn) };
}

/* Which column is which variable, in what unit, and how time is shifted. */
async function columnsOf(one) {
  const titles = one.columns.map((column) => column.title), none = "—", column = (title) => one.columns.find((two) =>
    two.title === title);
  const fields = [{ name: "time", label: "Time", choices: titles, value: one.time.title },
    { name: "unit", label: "Unit of time", value: one.timeUnit, hint: "s" },
    { name: "shift", label: "Shift in s", value: String(one.shift) },
    ...wanted().flatMap(({ name, unit }) => {
      const mine = one.pairs.get(name), text = results.content.units[unit]?.text;
      return [{ name: `c:${name}`, label: name, choices: [none, ...titles], value: mine?.column.title ?? none },
        { name: `u:${name}`, label: `Unit of that column (shown in ${text || "1"})`, value: mine?.unit ?? "",
          hint: "that of its title, or SI" }];
    })];
  const answer = await question(`Columns of ${one.name}`, fields, "Draw",
    "More variables: draw their curves first. Calibrate … in the list of runs finds values that fit.");
  if (!answer) return;
  const chosen = wanted().filter(({ name }) => answer[`c:${name}`] !== none).map(({ name }) => [name,
    { column: column(answer[`c:${name}`]), unit: answer[`u:${name}`] || column(answer[`c:${name}`]).unit }]);
  const next = { ...one, time: column(answer.time), timeUnit: answer.unit, shift: Number(answer.shift.replace(",", ".")) ||
    0, pairs: new Map(chosen) };
  await arranged(next).then(() => { Object.assign(one, next); listRuns(); drawCurves(); }, tell);
}

function listenToRuns() {
  at("keep").onclick = keepRun;
  at("best").onclick = bestDesign;
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

listeners.push(() => listRuns());

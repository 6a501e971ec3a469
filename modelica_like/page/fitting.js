/* A measured file is handed to calibrate: which values are to be found, between which bounds, and what came out; and
 * the best design that the netlist asks for. */
const MOST_ROWS = 500; // of a file: each is an output that is differentiated

function calibrateWith(one) {
  if (results.revision < 0) return say("It must be possible to run the drive before it is calibrated.", "refused");
  if (!one.pairs.size) return say(`Choose the columns of ${one.name} first.`, "refused");
  const rows = results.content.sliders.filter((known) => known.reference !== null).map((known) => {
    const bound = (word) => element("input", { value: short(known[word]), ariaLabel: `${known.name}: ${word}` });
    const box = element("input", { type: "checkbox", ariaLabel: `find ${known.name}` });
    const [low, high] = [bound("low"), bound("high")], unit = unitOf(known);
    const line = element("tr", {}, ...[element("label", {}, box, known.name), low, high, unit].map((cell) =>
      element("td", {}, cell)));
    return { known, box, low, high, line };
  });
  const said = element("p", { className: "refused" }), ok = element("button", { className: "main" }, "Calibrate");
  const cancel = element("button", { type: "button" }, "Cancel"), stop = new AbortController();
  const titles = ["value to find", "at least", "at most", ""].map((title) => element("th", {}, title));
  const names = [...one.pairs.keys()].join(", ");
  const form = element("form", {}, element("h2", {}, `Calibrate with ${one.name}`), element("p", { className: "about" },
    `Which values let ${names} of the drive be as they were measured? Bounds are what is physically possible.`),
    element("div", { className: "scroll" }, element("table", { className: "grid" }, element("thead", {},
      element("tr", {}, ...titles)), element("tbody", {}, ...rows.map((row) => row.line)))), said,
    element("div", { className: "row" }, cancel, ok));
  for (const row of rows) row.low.oninput = row.high.oninput = () => row.box.checked = true;
  cancel.onclick = () => at("dialog").close();
  at("dialog").onclose = () => stop.abort();
  form.onsubmit = async (event) => {
    event.preventDefault();
    const free = rows.filter((row) => row.box.checked).map(({ known, low, high }) => [known.name, ...[low, high].map(
      (field) => Number(field.value.trim().replace(",", ".") || NaN) * known.factor + known.offset)]);
    const wrong = !free.length ? "Choose at least one value." : free.flat().includes(NaN) ? "A bound is no number." : "";
    said.textContent = wrong || "Searching …";
    if (wrong) return;
    ok.disabled = true;
    const answer = await fitted(one, free, stop.signal).catch((error) => (said.textContent = error.message, null));
    ok.disabled = false;
    if (answer && !stop.signal.aborted) showFit(answer);
  };
  at("dialog").replaceChildren(form);
  at("dialog").showModal();
}

/* Finds the values, runs the drive with them, and keeps that run. */
async function fitted(one, free, signal) {
  const step = Math.ceil(one.run.times.length / MOST_ROWS), thin = (list) => [...list].filter((_, k) => k % step === 0);
  const asked = present(), answer = await post("calibrate", { ...asked, time: thin(one.run.times),
    columns: [...one.measured].map(([name, list]) => [name, thin(list).map((value) => Number.isFinite(value) ? value :
      null)]), free }, signal).then((made) => made.json());
  const found = answer.values.map(([name, value]) => [results.content.sliders.find((known) =>
    known.name === name), value]), { references } = results.run, { content } = results;
  const values = [...asked.values, ...found.map(([known, value]) => [known.reference, value])];
  const run = unpacked(await post("run", { ...asked, values, references }, signal).then((made) => made.arrayBuffer()),
    references, content);
  const change = new Map(found.map(([known, value]) => [known.name, inUnit(known, (value - known.offset) / known.factor)]));
  const fit = { name: `fit of ${one.name}`, run, on: true, change, about: answer.text };
  kept.push(fit);
  listRuns();
  drawCurves();
  return fit;
}

/* A value of a slider, as it is written into the netlist. */
const unitOf = (known) => ["1", "*"].includes(known.written) ? "" : known.written; // * is that of what it drives
const inUnit = (known, value) => `${Number(value.toPrecision(6))} ${unitOf(known)}`.trim();

function showFit(fit) {
  const take = element("button", { className: "main" }, "Take into the netlist"), close = element("button", {}, "Close");
  take.onclick = () => { at("dialog").close(); takeOver(fit); };
  close.onclick = () => at("dialog").close();
  at("dialog").onclose = null;
  at("dialog").replaceChildren(element("h2", {}, fit.name), element("pre", { className: "scroll" }, fit.about),
    element("div", { className: "row" }, close, take));
}

/* The netlist becomes that of a kept run, or takes the values of a fit; undo brings it back. */
async function takeOver(one) {
  if (one.text !== undefined && one.text !== page.text) await change("text", { text: one.text }).catch(tell);
  const steps = [...one.change].map(([path, text]) => ({ op: "set", path, value: meantBy(text) }));
  if (steps.length) await apply({ op: "together", steps });
}

/* ---- the best design ---- */
const LOOK = 300; // ms between two looks how many designs the search has tried

/* Searches, with a button that stops it; the values stand in the netlist then, and undo brings the others back. */
async function bestDesign() {
  if (results.revision < 0) return say("It must be possible to run the drive before its best design is sought.", "refused");
  const stop = new AbortController(), begin = page.text, bar = element("progress", { max: 1, value: 0 });
  const counted = element("p", { className: "about" }, "Searching …"), cancel = element("button", {}, "Cancel");
  const look = async () => {
    const [designs, most] = await ask("progress", {}, stop.signal).catch(() => [0, 1]);
    Object.assign(bar, { max: most, value: designs });
    if (designs) counted.textContent = `${designs} designs tried, at most about ${most}.`;
  };
  cancel.onclick = () => at("dialog").close();
  at("dialog").onclose = () => stop.abort();
  at("dialog").replaceChildren(element("h2", {}, "Best design"), counted, bar, element("div", { className: "row" }, cancel));
  at("dialog").showModal();
  const timer = setInterval(look, LOOK);
  const { revision, values } = present();
  const answer = await ask("optimize", { revision, values }, stop.signal).catch((error) => ({ failed: error.message }));
  clearInterval(timer);
  if (stop.signal.aborted || !answer) return;
  const changed = page.text !== begin, there = answer.text && !changed && answer.feasible;
  if (there) await change("text", { text: answer.text }).catch(tell);
  showBest(answer, there, !changed);
}

function showBest(answer, there, fits) {
  const close = element("button", { className: "main" }, "Close"), shut = () => at("dialog").close();
  const other = element("button", {}, there ? "Undo" : "Take into the netlist");
  close.onclick = shut;
  other.onclick = () => { shut(); change(...there ? ["undo", {}] : ["text", { text: answer.text }]).catch(tell); };
  at("dialog").onclose = null;
  const words = answer.failed ?? answer.about, stale = answer.text && !fits
    ? [element("p", { className: "refused" }, "The netlist has changed since, and stays as it is.")] : [];
  at("dialog").replaceChildren(element("h2", {}, "Best design"), element("div", { className: "page scroll" }, element("pre", {}, words)), ...stale,
    element("div", { className: "row" }, ...answer.text && fits ? [other] : [], close));
}

listeners.push(() => at("best").hidden = !Object.keys(section("optimize")).length);

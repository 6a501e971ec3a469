/* Runs of the drive: at each valid change, with the values of sliders, and at instants in the picture. */
const results = { content: null, shown: [], run: null, given: new Map(), revision: -1, picture: null, earlier: [] };
const MOST_EARLIER = 3; // runs before the last changes that stay drawn as thin lines
const valueAt = (one, p) => one.log ? one.low * (one.high / one.low) ** p : one.low + p * (one.high - one.low);
const positionOf = (one, value) =>
  one.log ? Math.log(value / one.low) / Math.log(one.high / one.low) : (value - one.low) / (one.high - one.low);
let running = null, modelling = 0;

/* ---- the model of the present text ---- */

async function model() {
  const mine = ++modelling, { revision, text } = page;
  running?.abort();
  if (!page.valid || !Object.keys(parts()).length) return noRun(page.valid ? "" : "The last run stays until the text is valid again.");
  const answer = await ask("model", { revision, shown: results.shown }).catch((error) => ({ problems: [],
    content: null, failed: error.message }));
  if (mine !== modelling || answer.stale) return;
  page.problems = answer.problems;
  listProblems();
  mark();
  paint();
  if (!answer.content) { inspect(); return noRun(answer.failed ?? ""); }
  Object.assign(results, { content: answer.content, revision, text, given: new Map() });
  results.shown = answer.content.variables.filter((one) => one.shown).map((one) => one.name);
  at("until").value = short(endTime().value);
  at("names").replaceChildren(...answer.content.variables.map((one) => element("option", { value: one.name })));
  await run(true);
  inspect();
}

function noRun(why) {
  at("curves").classList.add("stale");
  at("status").textContent = why;
  results.revision = -1;
}

const endTime = () => results.content.sliders.find((one) => one.reference === null);
const wanted = () => results.shown.map((name) => results.content.variables.find((one) =>
  one.name === name)).filter(Boolean);
const present = () => ({
  revision: results.revision, until: endTime().value,
  values: [...results.given].map(([path, value]) => { const one = results.content.sliders.find((known) =>
    known.name === path); return [one.reference, value * one.factor + one.offset]; }),
});

/* ---- runs ---- */

function tryValue(path, value) {
  results.given.set(path, value);
  run();
}

/* Runs the model; an older run is no longer wanted: the server notices that nobody waits for it. */
async function run(changed = false) {
  if (results.revision < 0) return;
  running?.abort();
  const { signal } = running = new AbortController(), { content } = results, begin = performance.now();
  const references = [...new Set([...wanted(), ...modesOf(content)].flatMap(used))];
  let data;
  try {
    data = await post("run", { ...present(), references }, signal).then((answer) => answer.arrayBuffer());
  } catch (error) {
    if (!signal.aborted) at("status").textContent = error.message;
    return;
  }
  if (signal.aborted) return;
  const computed = performance.now(), made = unpacked(data, references, content);
  if (made.message) say(made.message, "refused");
  if (made.times.length < 2) return noRun(made.message);
  if (changed && results.run) results.earlier = [results.run, ...results.earlier].slice(0, MOST_EARLIER);
  results.run = made;
  document.body.classList.remove("no-run");
  drawCurves();
  const events = made.events.length / 7;
  at("status").textContent = `${made.steps} steps, ${events} mode change${events === 1 ? "" : "s"}; the run took ${(computed - begin).toFixed(0)} ms.`;
  at("status").dataset.revision = results.revision;
  at("status").dataset.runs = Number(at("status").dataset.runs ?? 0) + 1;
  rank();
}

function unpacked(data, references, content) {
  const length = Number(new BigInt64Array(data, 0, 1)[0]), made = { references, content };
  const { sizes, ...about } = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 8, length)));
  let place = 8 + length;
  for (const [k, name] of ["times", "outputs", "events"].entries()) {
    made[name] = new Float64Array(data, place, sizes[k]);
    place += 8 * sizes[k];
  }
  return Object.assign(made, about);
}

function drawCurves() {
  if (!results.run || !results.content) return;
  at("curves").classList.remove("stale");
  const options = { shown: wanted(), end: Math.max(endTime().value, 0), remove: (one) => toggleCurve(one.name),
    choose: (time) => instant(time) };
  const { main, others } = compared();
  results.picture = new Picture(at("curves"), main, others, options);
  document.dispatchEvent(new Event("drawn"));
}

async function toggleCurve(name) {
  if (!results.content) return;
  const known = results.shown.includes(name);
  results.shown = known ? results.shown.filter((one) => one !== name) : [...results.shown, name];
  if (!known && !results.content.variables.some((one) => one.name === name)) return model(); // a formula
  return known ? drawCurves() : run();
}

/* ---- an instant in the picture ---- */

const playing = { on: false, time: 0, moving: false, busy: false };

async function instant(time) {
  if (results.revision < 0) return;
  Object.assign(playing, { on: true, time });
  document.body.classList.add("instant");
  at("clock").hidden = false;
  at("moment").max = endTime().value;
  at("moment").value = time;
  at("now").value = `${short(time, 4)} s`;
  results.picture?.readAt(time);
  if (playing.busy) return;
  playing.busy = true;
  const answer = await ask("instant", { ...present(), time }).catch(tell);
  playing.busy = false;
  if (!answer?.picture) return playing.on && leave();
  if (playing.on) draw(answer.picture);
  if (playing.on && playing.time !== time && !playing.moving) instant(playing.time);
}

function leave() {
  Object.assign(playing, { on: false, moving: false });
  document.body.classList.remove("instant");
  at("clock").hidden = true;
  results.picture?.read(null);
  draw(page.picture);
}

/* The whole run in eight seconds. */
async function play() {
  playing.moving = !playing.moving;
  at("play").textContent = playing.moving ? "❚❚" : "▶";
  const end = endTime().value, first = playing.time >= end ? 0 : playing.time, begin = performance.now();
  while (playing.moving && playing.on) {
    const time = Math.min(first + (end * (performance.now() - begin)) / 8000, end);
    await instant(time);
    if (time >= end) break;
    await new Promise(requestAnimationFrame);
  }
  playing.moving = false;
  at("play").textContent = "▶";
}

/* ---- what decides a final value ---- */

let ranked = 0, rankTimer = 0;
function rank() {
  const select = at("bars").querySelector("select"), names = wanted().filter((one) => !one.tree).map((one) =>
    one.name), chosenName = select.value;
  clearTimeout(rankTimer);
  if (names.join() !== [...select.options].map((one) => one.value).join()) {
    select.replaceChildren(...names.map((name) => element("option", { value: name }, name)));
    if (names.includes(chosenName)) select.value = chosenName;
  }
  if (at("bars").open && names.length) rankTimer = setTimeout(rankNow, QUIET);
}

async function rankNow() {
  const mine = ++ranked, table = at("bars").querySelector("table"), output = at("bars").querySelector("select").value;
  const answer = await ask("ranking", { output, ...present() }).catch((error) => error);
  if (mine !== ranked) return;
  if (answer instanceof Error) return void table.replaceChildren(element("caption", {}, answer.message));
  const most = Math.max(...answer.rows.map((row) => Math.abs(row[1])));
  table.replaceChildren(element("caption", {}, answer.caption), ...answer.rows.map(([name, value]) => {
    const bar = element("i", { className: value < 0 ? "negative" : "" });
    bar.style.width = `${(100 * Math.abs(value)) / most}%`;
    return element("tr", {}, element("th", {}, name), element("td", {}, short(value, 3)), element("td", {}, bar));
  }));
}

/* ---- problems ---- */

function listProblems() {
  at("problems").replaceChildren(...page.problems.slice(0, 40).map((one) => {
    const text = element("button", { className: "problem" }, element("b", {}, one.what), element("span", {}, [one.why,
      one.advice].filter(Boolean).join(" ")));
    text.onclick = () => showProblem(one);
    const actions = one.suggestion && isMine(one) ? [element("button", { className: "fix" }, one.fix)] : [];
    if (one.kind === "UntrustedModule") actions.push(element("button", { className: "fix" },
      "Run the modules of this folder"));
    if (actions.length) actions.at(-1).onclick = () => one.kind === "UntrustedModule" ? trust() : fix(one.suggestion);
    return element("li", { className: one.kind === "note" ? "note" : "" }, text, ...actions);
  }));
}

function showProblem(one) {
  const { part } = placeOf(one);
  if (part && part in parts()) select([part]);
  if (one.line && isMine(one)) {
    const begin = offsetOf(at("text").value, one.line, one.column ?? 1);
    at("text").scrollTop = Math.max(0, (one.line - 4) * letter().height);
    if (!at("textpane").hidden) { at("text").focus({ preventScroll: true });
    at("text").setSelectionRange(begin, begin + (one.length ?? 0)); }
  }
}

/* Applies a suggestion; a value that it cannot know is asked for in its field. */
function fix(one) {
  if (one.operation !== "set" || one.value !== undefined) return apply(one);
  select([head(one.path)]);
  setTimeout(() => at("inspector").querySelector(`[data-path="${CSS.escape(one.path)}"]`)?.focus(), 60);
}

listeners.push(() => { listProblems(); if (playing.on) leave(); model(); });

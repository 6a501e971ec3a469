/* What all scripts of the page share: its state, and requests to the process that has opened it (page/server.py). */
const PAGE = JSON.parse(document.getElementById("page").textContent);
const page = { // what is shown
  revision: 0, text: "", data: {}, problems: [], picture: "", valid: true, trail: [],
  selected: new Set(), line: null, // names of parts; or the ends of a line
};
const listeners = []; // called with each new state
const kinds = new Map(); // what a part of a type can be given, once it was asked for

let asking = 0; // requests that have no answer yet, but for the look at the file

async function post(what, content = {}, signal = undefined) {
  const headers = { "X-Token": PAGE.token }, body = JSON.stringify(content), counted = ["watch", "progress"].includes(what) ? 0 : 1;
  document.body.classList.toggle("busy", (asking += counted) > 0);
  const answer = await fetch(`/${what}`, { method: "POST", headers, body, signal }).catch((error) => {
    throw signal?.aborted ? error : new Error("Nobody answers. Start `modelica-like edit` again; the text is still here.");
  }).finally(() => document.body.classList.toggle("busy", (asking -= counted) > 0));
  if (!answer.ok || answer.headers.has("X-Refused")) throw new Error(await answer.text());
  return answer;
}

const ask = (what, content, signal) => post(what, content, signal).then((answer) => answer.json());

/* Tells a sentence below the picture; without one it goes. */
function say(text, kind = "") {
  at("said").textContent = text ?? "";
  at("said").className = kind;
}

const tell = (error) => (say(error.message, "refused"), null);

/* Requests that change the netlist follow each other, as they were made. */
let queue = Promise.resolve();
function change(what, content) {
  const mine = queue.then(() => ask(what, content)).then((state) => {
    say(state.notes?.length && what === "apply" ? state.notes.join(" ") : "", "note");
    return show(state);
  });
  queue = mine.catch(() => null);
  return mine;
}

/* Does an operation; true if it was done. A refusal is told. */
const apply = (request) => change("apply", { request }).then(() => true, (error) => (tell(error), false));

function show(state) {
  Object.assign(page, state);
  for (const name of page.selected) if (!(head(name) in parts())) page.selected.delete(name);
  page.line = null;
  for (const listener of listeners) listener(page);
  return state;
}

const head = (path) => path.split(".")[0].split("[")[0];
const parts = () => page.data.parts ?? {};
const section = (name) => (typeof page.data[name] === "object" && page.data[name]) || {};
const tableOf = (name) => {
  const table = parts()[head(name)], place = /\[(\d+)\]/.exec(name);
  return Array.isArray(table) ? table[place ? place[1] - 1 : 0] ?? {} : table ?? {};
};

/* What a part of a type can be given; null while that is not known. */
async function kindOf(kind, inner = []) {
  const key = [kind, ...inner].join("\n");
  if (!kinds.has(key)) {
    const known = await ask("kind", { kind, inner }).catch(() => undefined);
    if (known === undefined) return null; // it was refused, which need not last
    kinds.set(key, known);
  }
  return kinds.get(key);
}

/* A name for a new part: that of its type, with a number if it must be. */
function unusedName(kind) {
  const last = kind.split(":").pop().split("/").pop().replace(/\.(toml|mo)$/, "");
  const stem = last.replace(/([a-z0-9])([A-Z])/g, "$1_$2").replace(/\W/g, "_").toLowerCase();
  const taken = (name) => name in parts() || name in section("parameters") || name in section("expose");
  let name = stem;
  for (let k = 2; taken(name); k++) name = `${stem}_${k}`;
  return name;
}

/* Which part a problem is about, and which value of it. */
function placeOf(problem) {
  const [first, name, ...rest] = String(problem.path ?? "").split(".");
  const path = problem.suggestion?.operation === "set" ? problem.suggestion.path : "";
  if (path) return { part: head(path), value: path.split(".").slice(1).join(".") };
  if (first === "parts") return { part: head(name ?? ""), value: rest.join(".") };
  if (["start", "guess"].includes(first)) return { part: head((name ?? "").replaceAll(/["']/g, "")), value: "" };
  return { part: "", value: "" };
}

/* A small dialog with a form; resolves to its values, or null. */
function question(title, fields, action = "OK", about = "") {
  const inputs = fields.map(({ name, label, value = "", choices, hint = "" }) => {
    const input = choices ? element("select", { name }, ...choices.map((one) => element("option", { value: one }, one)))
      : element("input", { name, autocomplete: "off", spellcheck: false, placeholder: hint });
    input.value = value || input.value;
    return element("label", {}, label, input);
  });
  const form = element("form", { method: "dialog" }, element("h2", {}, title),
    ...(about ? [element("p", { className: "about" }, about)] : []), ...inputs,
    element("div", { className: "row" }, element("button", { type: "button", value: "cancel" }, "Cancel"),
      element("button", { className: "main", value: "ok" }, action)));
  at("dialog").replaceChildren(form);
  at("dialog").showModal();
  form.querySelector("button[type=button]").onclick = () => at("dialog").close("cancel");
  form.querySelector("input, select")?.select?.();
  return new Promise((go) => {
    form.onsubmit = () => at("dialog").returnValue = "ok";
    at("dialog").onclose = () => go(at("dialog").returnValue === "ok"
      ? Object.fromEntries([...new FormData(form)].map(([name, value]) => [name, value.trim()])) : null);
    at("dialog").returnValue = "";
  });
}

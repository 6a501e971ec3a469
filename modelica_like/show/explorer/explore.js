"use strict";
/* The drive runs in the process that has opened this page; see explorer/server.py. */
const QUIET = 300; // ms without a change after which sensitivities are asked for
let running = null;

async function post(what, content, signal) {
  const headers = { "X-Token": PAGE.token }, body = JSON.stringify(content);
  const answer = await fetch(what, { method: "POST", headers, body, signal }).catch((error) => {
    throw signal?.aborted ? error : new Error("nobody answers. Start `modelica-like explore` again.");
  });
  if (!answer.ok || answer.headers.has("X-Refused")) throw new Error(await answer.text());
  return answer;
}

async function openDrive() {
  return { simulate };
}

/* As `Drive.simulate` of wasm.js. An older run is no longer wanted: the server notices that nobody waits for it. */
async function simulate(values, references, until, wanted) {
  running?.abort();
  const { signal } = running = new AbortController();
  const data = await post("/run", { values, references, until }, signal).then((answer) => answer.arrayBuffer())
    .catch((error) => { if (!signal.aborted) throw error; });
  if (signal.aborted || !wanted()) return null;
  const length = Number(new BigInt64Array(data, 0, 1)[0]);
  const { sizes, ...found } = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 8, length)));
  let place = 8 + length;
  for (const [k, name] of ["times", "outputs", "events"].entries()) {
    found[name] = new Float64Array(data, place, sizes[k]);
    place += 8 * sizes[k];
  }
  return Object.assign(found, { references });
}

/* What the page stands at. */
const present = () => ({
  until: until.now,
  values: PAGE.sliders.filter((one) => one.reference !== null && one.now !== one.value)
    .map((one) => [one.reference, one.now * one.factor + one.offset]),
});

/* A click on a part in the schematic opens its parameters. */
function parts() {
  const groups = [...document.querySelectorAll("aside details")];
  for (const { textContent, parentNode: part } of document.querySelectorAll("#schematic g > title")) {
    const name = textContent.split(":")[0];
    const group = groups.find(({ firstChild: { textContent: path } }) => path === name || path.endsWith(`.${name}`));
    if (group === undefined) continue;
    part.style = "cursor: pointer; pointer-events: bounding-box";
    part.onclick = () => { group.open = true; group.scrollIntoView({ block: "nearest" }); };
  }
}

function files() {
  at("files").onclick = async ({ target: { value } }) => {
    if (!value) return;
    at("saved").textContent = "…";
    const answer = await post("/save", { what: value, ...present() }).then((one) => one.text(), (error) => error.message);
    at("saved").textContent = answer;
  };
}

function bars() {
  const select = at("bars").querySelector("select"), table = at("bars").querySelector("table");
  let timer = 0, number = 0;
  async function refresh() {
    const mine = ++number;
    const answer = await post("/ranking", { output: select.value, ...present() }).catch((error) => error);
    if (mine !== number) return;
    if (answer instanceof Error) return void table.replaceChildren(element("caption", {}, answer.message));
    const { caption, rows } = await answer.json(), most = Math.max(...rows.map((row) => Math.abs(row[1])));
    table.replaceChildren(element("caption", {}, caption),
      ...rows.map(([name, value]) => {
        const bar = element("i", { className: value < 0 ? "negative" : "" });
        bar.style.width = `${(100 * Math.abs(value)) / most}%`;
        return element("tr", {}, element("th", {}, name), element("td", {}, short(value, 3)), element("td", {}, bar));
      }));
  }
  const later = () => {
    clearTimeout(timer);
    const names = [...shown].filter((one) => !one.tree).map((one) => one.name), chosen = select.value;
    if (names.join() !== [...select.options].map((one) => one.value).join()) {
      select.replaceChildren(...names.map((name) => element("option", { value: name }, name)));
      if (names.includes(chosen)) select.value = chosen;
    }
    if (at("bars").open && names.length) timer = setTimeout(refresh, QUIET);
  };
  document.addEventListener("drawn", later);
  at("bars").ontoggle = select.onchange = later;
}

document.addEventListener("drawn", () => (parts(), files(), bars()), { once: true });

/* Files: saved on demand, seen when another editor writes them, exported, opened. */
const PERIOD = 1000; // ms between two looks at the file

async function save(name) {
  send();
  if (!name && !page.exists) {
    const answer = await question("Save the netlist", [{ name: "name", label: "File", value: page.file }], "Save",
      page.folder);
    if (!answer?.name) return;
    name = answer.name.endsWith(".toml") ? answer.name : `${answer.name}.toml`;
  }
  await change("save", name ? { name } : {}).then(() => say(`${page.file} is saved.`, "note"), tell);
}

async function exported(what) {
  if (what === "netlist under another name") {
    const answer = await question("Save as", [{ name: "name", label: "File", value: page.file }], "Save", page.folder);
    return answer?.name && save(answer.name.endsWith(".toml") ? answer.name : `${answer.name}.toml`);
  }
  if (results.revision < 0) return say("It must be possible to run the drive before it is written.", "refused");
  say("…", "note");
  await ask("export", { what, ...present() }).then((path) => say(`Written: ${path}`, "note"), tell);
}

/* Something new: another page has changed the netlist, or another editor the file. */
async function watch() {
  const seen = page.revision, answer = await ask("watch", { revision: seen }).catch(() => null);
  if (answer) {
    conflict(answer.conflict);
    await queue; // what this page changes meanwhile is no news, and has its own message
    if (page.revision === seen && answer.revision !== seen && !unsent) await change("state", {}).catch(tell);
  }
  setTimeout(watch, PERIOD);
}

function conflict(theirs) {
  const box = at("asked");
  if (theirs === null) { box.hidden = true; box.replaceChildren(); return; }
  if (!box.hidden && box.dataset.theirs === theirs) return;
  box.dataset.theirs = theirs;
  const take = element("button", {}, "Take the file"), mine = element("button", {}, "Keep mine");
  take.onclick = () => change("take", { theirs: true }).then(() => conflict(null), tell);
  mine.onclick = () => change("take", { theirs: false }).then(() => conflict(null), tell);
  box.replaceChildren(element("p", {},
    `Another program has changed ${page.file}, and this page has changes that are not saved. Which text stays? Undo brings the other one back.`),
    element("div", { className: "two" }, element("figure", {}, element("figcaption", {}, "in the file", take),
      element("pre", {}, theirs)),
      element("figure", {}, element("figcaption", {}, "in this page", mine), element("pre", {}, page.text))));
  box.hidden = false;
}

async function trust() {
  const answer = await question("Run the modules of this folder?", [], "Run them",
    `${page.folder}: a Python module can do all that you can. Do it only if you know who wrote it.`);
  if (answer) { kinds.clear(); await change("trust", {}).catch(tell); }
}

/* The shelf and the text can be folded away. */
function fold(what, open = document.body.classList.contains(`no-${what}`)) {
  document.body.classList.toggle(`no-${what}`, !open);
  at(`${what}-button`).ariaPressed = open;
  if (what === "text") { at("textpane").hidden = !open; if (open) paint(); }
}

function listenToFiles() {
  at("save").onclick = () => save();
  at("undo").onclick = () => step("undo");
  at("redo").onclick = () => step("redo");
  at("help").onclick = keys;
  at("shelf-button").onclick = () => fold("shelf");
  at("text-button").onclick = () => fold("text");
  const choices = ["netlist under another name", ...PAGE.files.map((what) => what === "netlist" ? "netlist" : what)];
  at("export").append(...choices.map((what) => element("option", { value: what },
    what === "netlist" ? "copy of the netlist" : what)));
  at("export").onchange = () => { const what = at("export").value; at("export").value = ""; exported(what); };
  addEventListener("beforeunload", (event) => { if (!page.saved && page.undo) event.preventDefault(); });
}

listeners.push((state) => {
  const names = state.trail.map((name, k) => {
    const made = element(k + 1 < state.trail.length ? "button" : "h1", {}, name);
    if (k + 1 < state.trail.length) made.onclick = async () => { for (let n = state.trail.length - 1; n > k;
    n--) await change("back", {}).catch(tell); };
    return made;
  });
  at("trail").replaceChildren(...names);
  at("unsaved").textContent = state.fixed ? "made in Python" : state.saved &&
    state.exists ? "" : state.exists ? "not saved" : "new";
  at("undo").disabled = !state.undo;
  at("redo").disabled = !state.redo;
  document.title = `${state.saved ? "" : "• "}${state.file}`;
});

/* The shelf: types of the libraries, classes and netlists of the folder, found by typing. */
let sought = 0, held = null; // the entry on which a button of the mouse is down

async function search(words = at("search").value.trim()) {
  const mine = ++sought, answer = await ask("palette", { words }).catch(tell);
  if (!answer || mine !== sought) return;
  const entries = answer.entries.map(entryOf);
  const more = answer.more ? [element("p", { className: "dim" }, `${answer.more} more: type another word.`)] : [];
  if (words && !entries.length) more.push(element("p", { className: "dim" },
    "Nothing has these words in its name or its text."));
  const groups = words ? [] : Object.entries(answer.groups).map(([name, count]) => {
    const button = element("button", { className: "group" }, element("span", {}, name), element("small", {},
      String(count)));
    button.onclick = () => { at("search").value = name.replaceAll("·", " "); search(name.replaceAll("·", " ")); };
    return button;
  });
  at("found").replaceChildren(...entries, ...groups, ...more);
}

function pictureOf(symbol) {
  const picture = element("span", { className: "symbol" });
  if (symbol) picture.append(document.adoptNode(new DOMParser().parseFromString(symbol,
    "image/svg+xml").documentElement));
  return picture;
}

function entryOf({ kind, group, about, symbol }) {
  const picture = pictureOf(symbol);
  const button = element("button", { className: "entry", title: `${kind} (${group})\n${about}` }, picture,
    element("span", {}, element("b", {}, kind.replace("./", "").replace(/([a-z])([A-Z])/g, "$1\u200b$2")),
      element("small", {}, about)));
  button.dataset.kind = kind;
  const take = () => carry({ kind, replace: at("shelf").dataset.replace });
  button.onpointerdown = (event) => {
    if (event.pointerType === "mouse" && !event.button) held = { x: event.clientX, y: event.clientY, take };
  };
  button.onclick = () => {
    if (carried?.dragged) return;
    if (at("shelf").dataset.replace) return replaceBy(kind);
    take();
  };
  return button;
}

/* The shelf asks by what a part is replaced. */
function replacing(name) {
  fold("shelf", true);
  at("shelf").dataset.replace = name;
  say(`Choose the type that takes the place of ${name}. Esc leaves it as it is.`, "note");
  at("search").focus();
}

async function replaceBy(kind) {
  const name = at("shelf").dataset.replace;
  delete at("shelf").dataset.replace;
  await apply({ op: "replace", name, kind });
  select([name]);
}

function listenToShelf() {
  let timer = 0;
  at("search").oninput = () => { clearTimeout(timer); timer = setTimeout(search, 90); };
  at("search").onkeydown = (event) => {
    const first = at("found").querySelector(".entry, .group");
    if ((event.key === "Enter" || event.key === "ArrowDown") && first) {
      event.preventDefault();
      if (event.key === "Enter" && first.matches(".entry")) { first.click(); at("sheet").focus(); } else first.focus();
    }
    if (event.key === "Escape") { delete at("shelf").dataset.replace; at("search").value = ""; search();
    at("search").blur(); }
  };
  at("found").onkeydown = (event) => {
    const all = [...at("found").querySelectorAll("button")], k = all.indexOf(document.activeElement);
    const next = { ArrowDown: k + 1, ArrowUp: k - 1 }[event.key];
    if (next === undefined) return;
    event.preventDefault();
    (all[next] ?? at("search")).focus();
  };
}

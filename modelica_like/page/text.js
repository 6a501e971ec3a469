/* The text of the netlist: a field with colours behind it, marks of problems, completion and explanations. */
const QUIET = 300; // ms without a key after which what is typed is read
const TOKENS = /(#.*)|("""[\s\S]*?"""|'''[\s\S]*?'''|"(?:\\.|[^"\\\n])*"?|'[^'\n]*'?)|^(\s*\[\[?[^\]\n]*\]?\]?)|([\w.-]+)(?=\s*=)|\b(true|false|[+-]?\d[\d_.]*(?:e[+-]?\d+)?)\b/gim;
const LOOKS = ["comment", "string", "section", "key", "number"];
let typed = 0, unsent = false, offered = [], choice = 0;

/* Pieces with classes; marks are [begin, end, class] over them. */
function coloured(text, marks) {
  const pieces = [];
  let place = 0;
  for (const match of text.matchAll(TOKENS)) {
    const look = LOOKS[match.slice(1).findIndex((one) => one !== undefined)];
    pieces.push([place, match.index, ""], [match.index, match.index + match[0].length, look]);
    place = match.index + match[0].length;
  }
  pieces.push([place, text.length, ""]);
  const cuts = marks.flatMap(([begin, end]) => [begin, end]), out = [];
  for (const [begin, end, look] of pieces) {
    const inner = [begin, ...cuts.filter((one) => one > begin && one < end).sort((a, b) => a - b), end];
    for (let k = 0; k + 1 < inner.length; k++) {
      if (inner[k] === inner[k + 1]) continue;
      const over = marks.find(([a, b]) => a <= inner[k] && inner[k] < b);
      const piece = element("span", { className: [look, over?.[2]].filter(Boolean).join(" ") }, text.slice(inner[k],
        inner[k + 1]));
      out.push(piece);
    }
  }
  return out;
}

/* The offset of a line and a column, which count from one, in characters of Python. */
function offsetOf(text, line, column) {
  let begin = 0;
  for (let k = 1; k < line; k++) begin = text.indexOf("\n", begin) + 1 || text.length;
  return begin + [...text.slice(begin).split("\n")[0]].slice(0, column - 1).join("").length;
}

const isMine = (problem) => !problem.file || problem.file.split(/[\\/]/).pop() === page.file;

function paint() {
  const text = at("text").value, marks = unsent ? [] : page.problems.filter((one) => one.line &&
    isMine(one)).map((one) => {
    const begin = offsetOf(text, one.line, one.column ?? 1), line = text.slice(begin).split("\n")[0];
    return [begin, begin + Math.max(one.length ? [...line].slice(0, one.length).join("").length : line.length, 1),
      one.kind === "note" ? "noted" : "marked"];
  });
  at("colours").replaceChildren(...coloured(text, marks), "\n");
  follow();
}

function follow() {
  at("colours").style.transform = `translate(${-at("text").scrollLeft}px, ${-at("text").scrollTop}px)`;
}

function send() {
  clearTimeout(typed);
  if (!unsent) return;
  unsent = false;
  change("text", { text: at("text").value }).catch(tell);
}

/* ---- completion ---- */

async function offer() {
  const text = at("text").value, place = at("text").selectionStart;
  const items = await ask("complete", { text, offset: [...text.slice(0, place)].length }).catch(() => []);
  if (at("text").value !== text || at("text").selectionStart !== place) return;
  const typedSo = (item) => slicePoints(text, item.span[0], [...text.slice(0, place)].length).replace(/^["']/,
    "").toLowerCase();
  words(items.filter((item) => item.text.replace(/^["']/, "").toLowerCase().startsWith(typedSo(item))).slice(0, 60));
}

const slicePoints = (text, begin, end) => [...text].slice(begin, end).join("");

function words(items) {
  const list = at("words");
  [offered, choice, list.hidden] = [items, 0, items.length === 0];
  if (!items.length) return;
  list.replaceChildren(...items.map((item, k) => {
    const made = element("li", { title: item.about }, element("b", {}, item.label), element("small", {},
      item.about.replace(item.label, "").replace(/^[:\s]+/, "").split("\n")[0]));
    made.role = "option";
    made.onpointerdown = (event) => { event.preventDefault(); choice = k; accept(); };
    return made;
  }));
  const box = caretBox();
  Object.assign(list.style, { left: `${Math.min(box.x, innerWidth - 340)}px`,
    top: `${Math.min(box.y + 20, innerHeight - 220)}px` });
  mark_(0);
}

function mark_(k) {
  choice = (k + offered.length) % offered.length;
  [...at("words").children].forEach((one, n) => one.ariaSelected = n === choice);
  at("words").children[choice].scrollIntoView({ block: "nearest" });
}

function accept() {
  const item = offered[choice], points = [...at("text").value];
  const begin = points.slice(0, item.span[0]).join("").length, end = points.slice(0, item.span[1]).join("").length;
  at("text").focus();
  at("text").setSelectionRange(begin, end);
  document.execCommand("insertText", false, item.text); // so that the field's own undo knows it
  words([]);
}

/* Where the caret is, by the size of a letter. */
function letter() {
  const style = getComputedStyle(at("text")),
    canvas = letter.canvas ??= document.createElement("canvas").getContext("2d");
  canvas.font = style.font;
  return { width: canvas.measureText("0").width, height: parseFloat(style.lineHeight),
    pad: parseFloat(style.paddingLeft), top: parseFloat(style.paddingTop) };
}

function caretBox() {
  const before = at("text").value.slice(0, at("text").selectionStart), line = before.split("\n"), size = letter(),
    box = at("text").getBoundingClientRect();
  return { x: box.x + size.pad + line.at(-1).length * size.width - at("text").scrollLeft,
    y: box.y + size.top + (line.length - 1) * size.height - at("text").scrollTop };
}

/* ---- explanation of the word under the pointer ---- */

let pausing = 0;
function pointed(event) {
  clearTimeout(pausing);
  hint("");
  pausing = setTimeout(async () => {
    const size = letter(), box = at("text").getBoundingClientRect(), text = at("text").value, lines = text.split("\n");
    const n = Math.floor((event.clientY - box.y - size.top + at("text").scrollTop) / size.height);
    const k = Math.floor((event.clientX - box.x - size.pad + at("text").scrollLeft) / size.width);
    if (!lines[n] || k < 0 || k >= lines[n].length) return;
    const problem = page.problems.find((one) => one.line === n + 1 && isMine(one) && k >= (one.column ?? 1) - 1 &&
      k < (one.column ?? 1) - 1 + (one.length ?? 999));
    const about = problem ? [problem.what, problem.why, problem.advice].filter(Boolean).join("\n")
      : await ask("explain", { text, offset: [...lines.slice(0, n).join("\n")].length + (n ? 1 : 0) + k }).catch(() =>
        "");
    if (about) hint(about.slice(0, 700), event);
  }, 350);
}

/* Shows the lines of a part. */
function scrollTo(name) {
  const lines = at("text").value.split("\n"), escapedName = name.replace(/[^\w]/g, "\\$&");
  const n = lines.findIndex((line) =>
    new RegExp(`^\\s*"?${escapedName}"?\\s*=\\s*[{\\[]|^\\[+parts\\."?${escapedName}"?\\]`).test(line));
  if (n < 0 || document.activeElement === at("text")) return;
  const { height } = letter();
  at("text").scrollTop = Math.max(0, n * height - at("text").clientHeight / 3);
}

function listenToText() {
  const field = at("text");
  field.oninput = (event) => {
    unsent = true;
    paint();
    clearTimeout(typed);
    typed = setTimeout(send, QUIET);
    if (/^insertText$/.test(event.inputType) && /[\w."'=\[{ ]/.test(event.data ?? "")) offer(); else words([]);
  };
  field.onscroll = follow;
  field.onblur = () => { words([]); send(); };
  field.onpointermove = pointed;
  field.onpointerleave = () => { clearTimeout(pausing); hint(""); };
  field.onkeydown = (event) => {
    if (event.key === " " && event.ctrlKey) { event.preventDefault(); return offer(); }
    if (at("words").hidden) return;
    const action = { ArrowDown: () => mark_(choice + 1), ArrowUp: () => mark_(choice - 1), Tab: accept,
      Enter: accept, Escape: () => words([]) }[event.key];
    if (action) { event.preventDefault(); event.stopPropagation(); action(); }
  };
}

listeners.push((state) => {
  const field = at("text");
  if (!unsent && field.value !== state.text.replaceAll("\r\n", "\n")) {
    const { selectionStart, scrollTop } = field;
    field.value = state.text;
    if (document.activeElement === field) field.setSelectionRange(selectionStart, selectionStart);
    field.scrollTop = scrollTop;
  }
  field.readOnly = state.fixed;
  paint();
});

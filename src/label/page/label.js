// The page: keys, pointers, buttons, and what is seen of them.

import { Marks } from "./marks.js";
import { Pace } from "./pace.js";
import { Pointers } from "./pointers.js";
import { View } from "./view.js";

const $ = (id) => document.getElementById(id);
const marks = new Marks();
const view = new View($("picture"));

let session = null;       // what the server told at the beginning
let image = 0;            // index of the image shown
let column = 0;           // index of the column that keys are about
let following = false;    // whether the view is to come along to the column and row that keys are about
let suggesting = false;
const pictures = new Map();     // index -> Promise of an Image
const suggestions = new Map();  // index -> rows
const places = new Map();       // name of an image -> its index
const pace = new Pace();
let alerted = "";

/// Milliseconds after which saving is worth a word.
const SLOW = 300;
/// Milliseconds until an image that could not be shown is tried again.
const RELOAD = 1500;

// ---- what there is

const name = (index = image) => session.images[index];
const x = (index = column) => session.columns[index];
const mark = (index = column, of = image) => marks.get(name(of), x(index));
const asked = () => session.images.length * session.columns.length;
const isDone = (of) => session.columns.every((_, i) => mark(i, of) !== null);
const inside = (row) => Math.min(Math.max(Math.round(row), 0), session.height - 1);

/// Where Enter would put a mark: as in the previous image, else as in the next column that has one.
function draft(index = column) {
  const before = image > 0 ? mark(index, image - 1) : null;
  if (typeof before === "number") return before;
  for (let distance = 1; distance < session.columns.length; distance += 1) {
    for (const near of [mark(index - distance), mark(index + distance)]) if (typeof near === "number") return near;
  }
  return inside(session.height * 0.6);
}

const row = () => (typeof mark() === "number" ? mark() : draft());

function told(value) {
  if (value === null) return "no mark";
  if (value === "skip") return "skipped";
  return value === 0 ? "ground all the way" : `row ${value}`;
}

// ---- changing marks

/// Only what is seen is marked.
function displayed() {
  if (view.image) return true;
  say(lacking || `${name()} is not shown yet: wait for it, then mark.`);
  unmarked = true;
  return false;
}

function put(value, joined = false) {
  if (!displayed()) return false;
  const fresh = mark() === null;
  marks.set([{ image: name(), x: x(), to: value }], joined);
  if (fresh && value !== null) pace.note(1);
  say();
  return true;
}

function nudge(rows) {
  following = true;
  put(inside(row() + rows), true);
}

/// To the next column without a mark, in this image or the next; a complete image goes on to the next one.
function advance() {
  const later = session.columns.findIndex((_, i) => i > column && mark(i) === null);
  const left = later >= 0 ? later : session.columns.findIndex((_, i) => mark(i) === null);
  if (left >= 0) choose(left);
  else if (image + 1 < session.images.length) show(image + 1);
  else if (!firstGap()) say("Every column of every image is marked. Thank you.");
}

function accept() {
  if (mark() === null) { if (!put(draft())) return; }
  // One that is marked already is passed by, column by column, so that a frame can be looked through.
  else if (column + 1 < session.columns.length && isDone(image)) return choose(column + 1);
  advance();
}

function andOn(value) {
  if (put(value)) advance();
}

function copy() {
  if (image === 0) return say("There is no previous image.");
  if (!displayed()) return;
  const free = session.columns.map((_, i) => i).filter((i) => mark(i) === null && mark(i, image - 1) !== null);
  const count = marks.set(free.map((i) => ({ image: name(), x: x(i), to: mark(i, image - 1) })));
  pace.note(count);
  say(count ? `Copied ${count} mark${count === 1 ? "" : "s"} from the previous image.` : "Nothing to copy.");
}

function undo() {
  const step = marks.undo();
  if (!step) return say("Nothing to undo.");
  const at = step.done[0];
  if (at) {
    const index = places.get(at.image) ?? image;
    if (index !== image) show(index);
    choose(Math.max(session.columns.indexOf(at.x), 0));
    pace.forget(step.done.filter(({ to }) => to === null).length);
    say(`Undone: column ${column + 1} is ${told(mark())} again.`);
  } else {
    say("Not undone: another window has changed this mark since.");
  }
}

// ---- going about

function choose(index) {
  pointers.release();
  column = Math.min(Math.max(index, 0), session.columns.length - 1);
  following = true;
  say();
}

function firstGap() {
  const index = session.images.findIndex((_, i) => !isDone(i));
  if (index < 0) return false;
  show(index);
  return true;
}

function picture(index) {
  if (!pictures.has(index)) {
    const loaded = new Image();
    loaded.src = marks.address(index);
    const ready = loaded.decode().then(() => loaded);
    ready.catch(() => { if (pictures.get(index) === ready) pictures.delete(index); });
    pictures.set(index, ready);
  }
  return pictures.get(index);
}

let lacking = "";       // why the image is not shown
let unmarked = false;   // whether a mark was refused for that
let reload = null;

function show(index) {
  if (index < 0 || index >= session.images.length) return say(index < 0 ? "This is the first image." : "This is the last image.");
  pointers.release();
  image = index;
  following = true;
  lacking = "";
  // Never the marks of one image on another; one that is there already is shown before the next frame is drawn.
  view.image = null;
  const gap = session.columns.findIndex((_, i) => mark(i) === null);
  column = Math.max(gap, 0);
  // Browsers allow it only so many times in a while.
  try { history.replaceState(null, "", `#${image + 1}`); } catch { /* the address lags behind */ }
  say();
  if (suggesting) suggest();
  // Those that come next are there before they are asked for; those far away are forgotten.
  for (const old of [...pictures.keys()].filter((i) => Math.abs(i - image) > 8)) pictures.delete(old);
  load(index);
}

async function load(index) {
  clearTimeout(reload);
  try {
    const ready = picture(index);
    for (const near of [index + 1, index + 2, index - 1]) {
      if (near >= 0 && near < session.images.length) picture(near).catch(() => {});
    }
    const loaded = await ready;
    if (image !== index || pictures.get(index) !== ready) return;
    view.image = loaded;
    if (unmarked || lacking) say();
    lacking = "";
    unmarked = false;
    paint();
  } catch {
    if (image !== index || view.image) return;
    lacking = `${name()} cannot be shown, so it cannot be marked; is vsonar still running?`;
    say(lacking);
    reload = setTimeout(() => load(index), RELOAD);
  }
}

// ---- suggestions

async function suggest() {
  const index = image;
  if (!suggestions.has(index)) {
    try {
      suggestions.set(index, await marks.suggestions(index));
    } catch (error) {
      return say(`No suggestions: ${error.message}`);
    }
  }
  if (index === image) paint();
}

const suggested = (index = column) => (suggesting ? suggestions.get(image)?.[index] ?? null : null);

function toggleSuggestions() {
  if (!session.suggests) return say("No detector was given: start with vsonar label DIR --suggest PROGRAM.");
  suggesting = !suggesting;
  $("suggest").setAttribute("aria-pressed", suggesting);
  $("take").hidden = !suggesting;
  if (suggesting) suggest();
  say(suggesting ? "The detector's answers are shown; a takes one." : "The detector's answers are hidden.");
}

async function take(all) {
  if (!suggesting) return toggleSuggestions();
  const at = image;
  if (!suggestions.has(image)) await suggest();
  if (at !== image || !displayed()) return;
  const columns = all ? session.columns.map((_, i) => i).filter((i) => mark(i) === null) : [column];
  const wanted = columns.filter((i) => suggested(i) !== null);
  if (!wanted.length) return say(all ? "Nothing to take." : "The detector has no answer in this column.");
  const fresh = wanted.filter((i) => mark(i) === null).length;
  marks.set(wanted.map((i) => ({ image: name(), x: x(i), to: suggested(i) })));
  pace.note(fresh);
  if (all) say(`Took ${wanted.length} answer${wanted.length === 1 ? "" : "s"}.`); else advance();
}

// ---- what is seen

let painting = false;
function paint() {
  if (painting) return;
  painting = true;
  requestAnimationFrame(() => { painting = false; if (session) render(); });
}

/// Says what there is at the column, or something else.
let message = "";
function say(text = "") {
  message = text;
  paint();
}

function render() {
  const { drag } = pointers;
  // Not under a pointer, and not to take back where a hand has moved the view.
  if (following && drag === null) view.follow(x() + 0.5, row() + 1);
  following = false;
  view.draw(session.columns.map((at, i) => ({
    x: at, number: i + 1, active: i === column,
    mark: i === column && drag !== null ? drag : mark(i),
    draft: i === column ? draft(i) : 0,
    before: image > 0 ? mark(i, image - 1) : null,
    suggestion: suggested(i),
  })));
  $("name").textContent = name();
  $("count").textContent = `Image ${image + 1} of ${session.images.length} · ${session.folder}`;
  document.title = `${image + 1}/${session.images.length} ${name()} – vsonar label`;
  canvas.dataset.image = view.image ? image + 1 : "";
  renderColumns();
  renderProgress();
  renderSaved();
  const value = drag ?? mark();
  const here = `Column ${column + 1} of ${session.columns.length}, x = ${x()}: ${value === null ? `${told(draft())} if accepted` : told(value)}`;
  const status = message || (isDone(image) ? `${here} · image complete` : here);
  if ($("status").textContent !== status) $("status").textContent = status;
  $("previous").disabled = image === 0;
  $("next").disabled = image === session.images.length - 1;
  $("copy").disabled = image === 0;
  $("accept").textContent = mark() === null ? "Accept" : "Go on";
}

function renderColumns() {
  const buttons = $("columns").children;
  session.columns.forEach((at, i) => {
    const button = buttons[i];
    const value = mark(i);
    const shown = value === null ? "–" : value === "skip" ? "skip" : value === 0 ? "ground" : String(value);
    const kind = value === null ? "none" : value === "skip" ? "skip" : "row";
    if (button.dataset.mark !== kind) button.dataset.mark = kind;
    if (button.lastChild.textContent !== shown) {
      button.lastChild.textContent = shown;
      button.setAttribute("aria-label", `Column ${i + 1} at ${at}: ${told(value)}`);
    }
    button.setAttribute("aria-pressed", i === column);
  });
  const active = buttons[column];
  const list = $("columns");
  if (active && list.scrollWidth > list.clientWidth) {
    const left = active.offsetLeft - list.offsetLeft;
    if (left < list.scrollLeft || left + active.offsetWidth > list.scrollLeft + list.clientWidth) list.scrollLeft = left - 40;
  }
}

/// Marks made and images done: counted once, and again for images whose marks have changed.
let tally = null;

function countAll() {
  tally = { done: 0, images: 0, made: session.images.map(() => 0) };
  session.images.forEach((_, i) => count(i));
}

function count(index) {
  const [before, made] = [tally.made[index], session.columns.filter((_, i) => mark(i, index) !== null).length];
  const all = session.columns.length;
  tally.made[index] = made;
  tally.done += made - before;
  tally.images += (made === all) - (before === all);
}

function renderProgress() {
  const { done, images } = tally;
  const all = asked();
  $("bar").firstChild.style.width = `${100 * done / all}%`;
  $("bar").setAttribute("aria-valuemax", all);
  $("bar").setAttribute("aria-valuenow", done);
  document.body.dataset.done = done;
  const parts = [`${done} of ${all} marks`, `${images} image${images === 1 ? "" : "s"} done`];
  const left = pace.left(all - done);
  if (left) parts.push(left);
  $("rate").textContent = parts.join(" · ");
}

function renderSaved() {
  const lost = marks.problem !== null;
  const state = lost ? "lost" : marks.unsaved ? (marks.waiting > SLOW ? "saving" : "sending") : "saved";
  $("saved").dataset.state = state;
  const text = lost ? (marks.unsaved ? `${marks.unsaved} not saved` : "No connection") : state === "saved" ? "Saved" : "Saving…";
  if ($("saved-text").textContent !== text) $("saved-text").textContent = text;
  const problem = lost
    ? `${marks.unsaved ? `${marks.unsaved} mark${marks.unsaved === 1 ? " is" : "s are"} not saved yet, and kept in this window: ` : ""}${marks.problem} Trying again.`
    : alerted;
  $("alert").hidden = !problem;
  if ($("alert").textContent !== problem) $("alert").textContent = problem;
  if (state === "sending") setTimeout(paint, SLOW);
}

function help() {
  $("help").showModal();
  $("help").scrollTop = 0;
}

// ---- keys

const KEYS = {
  Enter: accept, " ": accept,
  ArrowUp: (e) => nudge(e.shiftKey ? -10 : -1), ArrowDown: (e) => nudge(e.shiftKey ? 10 : 1),
  PageUp: () => nudge(-10), PageDown: () => nudge(10),
  ArrowLeft: () => choose(column - 1), ArrowRight: () => choose(column + 1),
  Home: () => choose(0), End: () => choose(session.columns.length - 1),
  g: () => andOn(0), x: () => andOn("skip"), c: copy, u: undo,
  Delete: () => put(null), Backspace: () => put(null),
  n: () => show(image + 1), p: () => show(image - 1),
  f: () => firstGap() || say("Every column of every image is marked."),
  s: toggleSuggestions, a: (e) => take(e.shiftKey),
  "+": () => zoom(1.5), "=": () => zoom(1.5), "-": () => zoom(1 / 1.5), "0": () => { view.fit(); paint(); },
  "?": help,
};

function zoom(factor) {
  view.zoomBy(factor, { x: x() + 0.5, y: row() + 1 });
  following = true;
  paint();
}

document.addEventListener("keydown", (event) => {
  if (!session || $("help").open || event.altKey || event.metaKey && event.key !== "z") return;
  if (event.ctrlKey || event.metaKey) {
    if (event.key === "z") { undo(); event.preventDefault(); }
    return;
  }
  // A button that has the focus is pressed by these.
  if (event.target instanceof HTMLButtonElement && (event.key === "Enter" || event.key === " ")) return;
  if (event.key >= "1" && event.key <= "9") {
    const index = Number(event.key) - 1;
    if (index < session.columns.length) choose(index);
    return;
  }
  const action = KEYS[event.key] ?? (event.key.length === 1 ? KEYS[event.key.toLowerCase()] : undefined);
  if (!action) return;
  event.preventDefault();
  alerted = "";
  // Held down, a key moves; it does not mark one column after the other.
  const moves = event.key.startsWith("Arrow") || event.key.startsWith("Page") || "np+-=".includes(event.key);
  if (!event.repeat || moves) action(event);
});

// ---- pointers

function nearest(at) {
  let best = 0;
  session.columns.forEach((c, i) => { if (Math.abs(c + 0.5 - at.x) < Math.abs(x(best) + 0.5 - at.x)) best = i; });
  return best;
}

const canvas = $("picture");
const pointers = new Pointers(canvas, view, {
  inside, paint, put,
  begin(at) {
    if (!session) return false;
    alerted = "";
    column = nearest(at);
    say();
    return displayed();
  },
});

// ---- buttons

const BUTTONS = {
  previous: () => show(image - 1), next: () => show(image + 1), up: () => nudge(-1), down: () => nudge(1), accept,
  ground: () => andOn(0), skip: () => andOn("skip"), copy, clear: () => put(null), undo, suggest: toggleSuggestions,
  take: () => take(false), "zoom-in": () => zoom(1.5), "zoom-out": () => zoom(1 / 1.5),
  "zoom-fit": () => { view.fit(); paint(); }, "help-open": help,
};
for (const [id, action] of Object.entries(BUTTONS)) {
  $(id).addEventListener("click", (event) => {
    if (!session) return;
    alerted = "";
    action();
    // Pressed with a pointer, it does not keep the keys for itself.
    if (event.detail > 0) event.currentTarget.blur();
  });
}
// Held down, the arrows go on.
for (const [id, rows] of [["up", -1], ["down", 1]]) {
  let timer = null;
  let held = false;
  const stop = () => { clearTimeout(timer); timer = null; };
  $(id).addEventListener("pointerdown", () => {
    held = false;
    const again = () => { held = true; nudge(rows); timer = setTimeout(again, 60); };
    timer = setTimeout(again, 400);
  });
  for (const kind of ["pointerup", "pointerleave", "pointercancel"]) $(id).addEventListener(kind, stop);
  // The click that ends it is not one row more.
  $(id).addEventListener("click", (event) => {
    if (held && event.detail > 0) { event.stopImmediatePropagation(); $(id).blur(); }
  }, { capture: true });
  $(id).addEventListener("contextmenu", (event) => event.preventDefault());
}

// ---- beginning

let beginning = false;
let hindered = "";      // why it could not begin, as it is shown
async function begin() {
  if (beginning) return;
  beginning = true;
  try {
    session = await marks.begin();
  } catch (error) {
    alerted = hindered = `${error.message} Trying again.`;
    if (session) paint();
    else { $("alert").hidden = false; $("alert").textContent = alerted; }
    return setTimeout(() => { beginning = false; begin(); }, RELOAD);
  }
  beginning = false;
  if (alerted === hindered) alerted = "";
  places.clear();
  session.images.forEach((file, i) => places.set(file, i));
  countAll();
  pictures.clear();
  suggestions.clear();
  document.body.classList.toggle("suggests", session.suggests);
  $("suggest").hidden = !session.suggests;
  $("columns").replaceChildren(...session.columns.map((at, i) => {
    const button = document.createElement("button");
    button.type = "button";
    const [number, value] = ["key", "value"].map((c) => Object.assign(document.createElement("span"), { className: c }));
    number.textContent = i + 1;
    button.append(number, value);
    button.addEventListener("click", (event) => { choose(i); if (event.detail > 0) button.blur(); });
    return button;
  }));
  $("left-out").hidden = !session.left_out.length;
  $("left-out").lastElementChild.replaceChildren(...session.left_out.map(({ name: file, why }) =>
    Object.assign(document.createElement("li"), { textContent: `${file}: ${why}` })));
  view.resize(session.width, session.height);
  const asked = Number(location.hash.slice(1)) - 1;
  if (session.images[asked]) show(asked);
  else if (!firstGap()) show(0);
  document.body.dataset.ready = "true";
}

marks.addEventListener("change", ({ detail: files }) => {
  for (const file of files) if (tally && places.has(file)) count(places.get(file));
  // What is not saved is never called saved, not even until the next frame.
  if (session) renderSaved();
  paint();
});
marks.addEventListener("say", (event) => { alerted = event.detail; paint(); });
marks.addEventListener("restart", begin);
marks.addEventListener("refused", ({ detail: { image: file, x: at, to, now } }) => {
  const index = session.columns.indexOf(at) + 1;
  alerted = `Column ${index} of ${file} was marked elsewhere meanwhile and is ${told(now)}; yours (${told(to)}) was not saved. Mark it again to replace it.`;
  paint();
});
window.addEventListener("resize", () => { view.hold(); paint(); });
window.addEventListener("beforeunload", (event) => { if (marks.unsaved) event.preventDefault(); });
window.addEventListener("pagehide", () => marks.leave());
begin();

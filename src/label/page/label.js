// Labelling: marks are made and taken back, one goes from column to column and from image to image.

import {
  begun, column, draft, image, inside, isDone, mark, marks, name, pick, places, row, session, shownName, suggest,
  suggested, suggesting, suggestions, told, turnTo, x,
} from "./desk.js";
import { listen, task } from "./keys.js";
import { Pointers } from "./pointers.js";
import { $, alerted, canvas, count, countAll, follow, pace, paint, renderSaved, say, showDrag, tally, view, warn } from "./screen.js";

const pictures = new Map();     // index -> Promise of an Image

/// Milliseconds until an image that could not be shown is tried again.
const RELOAD = 1500;

// ---- changing marks
/// Only what is seen is marked.
function displayed() {
  if (view.image) return true;
  say(lacking || `${shownName()} is not shown yet: wait for it, then mark.`);
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
  follow();
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
  pick(Math.min(Math.max(index, 0), session.columns.length - 1));
  follow();
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
  turnTo(index);
  follow();
  lacking = "";
  // Never the marks of one image on another; one that is there already is shown before the next frame is drawn.
  view.image = null;
  view.awaited = name();
  const gap = session.columns.findIndex((_, i) => mark(i) === null);
  pick(Math.max(gap, 0));
  // Browsers allow it only so many times in a while.
  try { history.replaceState(null, "", `#${image + 1}`); } catch { /* the address lags behind */ }
  say();
  if (suggesting) fetchSuggestions();
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
    view.awaited = "";
    if (unmarked || lacking) say();
    lacking = "";
    unmarked = false;
    paint();
  } catch {
    if (image !== index || view.image) return;
    view.awaited = "";
    lacking = `${shownName()} cannot be shown, so it cannot be marked; is vsonar still running?`;
    say(lacking);
    reload = setTimeout(() => load(index), RELOAD);
  }
}

// ---- suggestions
async function fetchSuggestions() {
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

function toggleSuggestions() {
  if (!session.suggests) return say("No detector was given: start with vsonar label DIR --suggest PROGRAM.");
  suggest(!suggesting);
  $("suggest").setAttribute("aria-pressed", suggesting);
  $("take").hidden = !suggesting;
  if (suggesting) fetchSuggestions();
  say(suggesting ? "The detector's answers are shown; a takes one." : "The detector's answers are hidden.");
}

async function take(all) {
  if (!suggesting) return toggleSuggestions();
  const at = image;
  if (!suggestions.has(image)) await fetchSuggestions();
  if (at !== image || !displayed()) return;
  const columns = all ? session.columns.map((_, i) => i).filter((i) => mark(i) === null) : [column];
  const wanted = columns.filter((i) => suggested(i) !== null);
  if (!wanted.length) return say(all ? "Nothing to take." : "The detector has no answer in this column.");
  const fresh = wanted.filter((i) => mark(i) === null).length;
  marks.set(wanted.map((i) => ({ image: name(), x: x(i), to: suggested(i) })));
  pace.note(fresh);
  if (all) say(`Took ${wanted.length} answer${wanted.length === 1 ? "" : "s"}.`); else advance();
}

// ---- pointers, keys and buttons
function nearest(at) {
  let best = 0;
  session.columns.forEach((c, i) => { if (Math.abs(c + 0.5 - at.x) < Math.abs(x(best) + 0.5 - at.x)) best = i; });
  return best;
}

const pointers = new Pointers(canvas, view, {
  inside, paint, put,
  begin(at) {
    if (!session) return false;
    warn();
    pick(nearest(at));
    say();
    return displayed();
  },
});
showDrag(() => pointers.drag);
listen({ accept, andOn, choose, copy, firstGap, nudge, put, show, take, toggleSuggestions, undo });

// ---- beginning
let beginning = false;
let hindered = "";      // why it could not begin, as it is shown
async function begin() {
  if (beginning) return;
  beginning = true;
  try {
    begun(await marks.begin());
  } catch (error) {
    hindered = `${error.message} Trying again.`;
    warn(hindered);
    if (session) paint();
    else { $("alert").hidden = false; $("alert").textContent = alerted; }
    return setTimeout(() => { beginning = false; begin(); }, RELOAD);
  }
  beginning = false;
  if (alerted === hindered) warn();
  countAll();
  pictures.clear();
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
  list("notes", session.notes);
  list("left-out", session.left_out.map(({ name: file, why }) => `${file}: ${why}`));
  view.resize(session.width, session.height);
  const asked = Number(location.hash.slice(1)) - 1;
  if (session.images[asked]) show(asked);
  else if (!firstGap()) show(0);
  if (!document.body.dataset.ready) {
    if (session.remarks.length) warn(session.remarks.join(" "));
    task();
  }
  document.body.dataset.ready = "true";
}

/// Shows a heading and lines below it, if there are lines.
function list(id, lines) {
  $(id).hidden = !lines.length;
  $(id).lastElementChild.replaceChildren(...lines.map((text) =>
    Object.assign(document.createElement("li"), { textContent: text })));
}

marks.addEventListener("change", ({ detail: files }) => {
  for (const file of files) if (tally && places.has(file)) count(places.get(file));
  // What is not saved is never called saved, not even until the next frame.
  if (session) renderSaved();
  paint();
});
marks.addEventListener("say", (event) => { warn(event.detail); paint(); });
marks.addEventListener("restart", begin);
marks.addEventListener("refused", ({ detail: { image: file, x: at, to, now } }) => {
  const index = session.columns.indexOf(at) + 1;
  warn(`Column ${index} of ${file} was marked elsewhere meanwhile and is ${told(now)}; yours (${told(to)}) was not saved. Mark it again to replace it.`);
  paint();
});
// Not the window alone: a line of the page that comes or goes leaves it another room.
new ResizeObserver(() => { view.hold(); paint(); }).observe(canvas);
window.addEventListener("beforeunload", (event) => { if (marks.unsaved) event.preventDefault(); });
window.addEventListener("pagehide", () => marks.leave());
begin();

// What is seen of the desk: the picture with its marks, the line below it, the columns, how far it is and what is saved.

import {
  asked, column, draft, image, isDone, mark, marks, row, session, shownName, suggested, told,
  x,
} from "./desk.js";
import { Pace } from "./pace.js";
import { View } from "./view.js";

export const $ = (id) => document.getElementById(id);
export const canvas = $("picture");
export const view = new View(canvas, $("pixels"));
export const pace = new Pace();

/// Milliseconds after which saving is worth a word.
const SLOW = 300;

let following = false;          // whether the view is to come along to the column and row that keys are about
let dragged = () => null;       // the row under a pointer that drags a mark
export let alerted = "";

export function follow() { following = true; }
export function showDrag(of) { dragged = of; }
export function warn(text = "") { alerted = text; }

export function zoom(factor) {
  view.zoomBy(factor, { x: x() + 0.5, y: row() + 1 });
  follow();
  paint();
}

export function fit() {
  view.fit();
  paint();
}

/// Shows pixels brighter or darker by so many half stops, in this and every other image; nothing else depends on it.
export function light(halfStops) {
  const slider = $("light");
  slider.value = halfStops;
  const times = 2 ** (slider.valueAsNumber / 2);
  slider.setAttribute("aria-valuetext", `${times.toFixed(1)} times`);
  $("light-reset").disabled = times === 1;
  view.below.style.filter = times === 1 ? "" : `brightness(${times})`;
}

export const lighter = (halfStops) => light($("light").valueAsNumber + halfStops);

let painting = false;
export function paint() {
  if (painting) return;
  painting = true;
  requestAnimationFrame(() => { painting = false; if (session) render(); });
}

/// Says what there is at the column, or something else.
let message = "";
export function say(text = "") {
  message = text;
  paint();
}

function render() {
  const drag = dragged();
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
  $("name").textContent = shownName();
  $("count").textContent = `Image ${image + 1} of ${session.images.length} · ${session.folder}`;
  document.title = `${image + 1}/${session.images.length} ${shownName()} – vsonar label`;
  canvas.dataset.image = view.image ? image + 1 : "";
  $("loading").hidden = !view.awaited;
  const awaited = `Loading ${view.awaited} …`;
  if (view.awaited && $("loading").lastChild.textContent !== awaited) $("loading").lastChild.textContent = awaited;
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
export let tally = null;

export function countAll() {
  tally = { done: 0, images: 0, made: session.images.map(() => 0) };
  session.images.forEach((_, i) => count(i));
}

export function count(index) {
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

export function renderSaved() {
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

// What is labelled and where one is in it: images, columns, their marks, and what a detector suggests.

import { Marks } from "./marks.js";

export const marks = new Marks();
export let session = null;      // what the server told at the beginning
export let image = 0;           // index of the image shown
export let column = 0;          // index of the column that keys are about
export let suggesting = false;
export const suggestions = new Map();  // index -> rows
export const places = new Map();       // name of an image -> its index

/// Begins with what the server told, or begins again.
export function begun(answer) {
  session = answer;
  places.clear();
  session.images.forEach((file, i) => places.set(file, i));
  suggestions.clear();
}

export function turnTo(index) { image = index; }
export function pick(index) { column = index; }
export function suggest(on) { suggesting = on; }

export const name = (index = image) => session.images[index];
/// The name as it is shown: without what would turn or hide the words around it.
export const shownName = (index = image) => session.shown[index];
export const x = (index = column) => session.columns[index];
export const mark = (index = column, of = image) => marks.get(name(of), x(index));
export const asked = () => session.images.length * session.columns.length;
export const isDone = (of) => session.columns.every((_, i) => mark(i, of) !== null);
export const inside = (row) => Math.min(Math.max(Math.round(row), 0), session.height - 1);

/// Where Enter would put a mark: as in the previous image, else as in the next column that has one.
export function draft(index = column) {
  const before = image > 0 ? mark(index, image - 1) : null;
  if (typeof before === "number") return before;
  for (let distance = 1; distance < session.columns.length; distance += 1) {
    for (const near of [mark(index - distance), mark(index + distance)]) if (typeof near === "number") return near;
  }
  return inside(session.height * 0.6);
}

export const row = () => (typeof mark() === "number" ? mark() : draft());

export function told(value) {
  if (value === null) return "no mark";
  if (value === "skip") return "skipped";
  return value === 0 ? "ground all the way" : `row ${value}`;
}

export const suggested = (index = column) => (suggesting ? suggestions.get(image)?.[index] ?? null : null);

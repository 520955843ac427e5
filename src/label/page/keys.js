// Keys and buttons, and what each of them does.

import { column, image, session } from "./desk.js";
import { $, fit, light, lighter, say, warn, zoom } from "./screen.js";

/// What a browser that has seen the task remembers. The port differs each time, and the page's storage with it; a cookie is
/// for all ports.
const SEEN = "vsonar-label=seen";

function help() {
  $("help").showModal();
  $("help").scrollTop = 0;
}

/// Shows the task to whoever sees the page for the first time.
export function task() {
  $("help").addEventListener("close", () => { document.cookie = `${SEEN}; path=/; max-age=31536000; samesite=strict`; });
  if (!document.cookie.split("; ").includes(SEEN)) help();
}

/// Has keys and buttons do these, from now on.
export function listen({ accept, andOn, choose, copy, firstGap, nudge, put, show, take, toggleSuggestions, undo }) {
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
    "+": () => zoom(1.5), "=": () => zoom(1.5), "-": () => zoom(1 / 1.5), "0": fit,
    b: () => lighter(1), d: () => lighter(-1), r: () => light(0),
    "?": help,
  };

  document.addEventListener("keydown", (event) => {
    // Capital letters act as the small ones: caps lock may be on.
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (!session || $("help").open || event.altKey || event.metaKey && key !== "z") return;
    if (event.ctrlKey || event.metaKey) {
      // With Shift it is asked for the opposite, which there is not.
      if (key === "z" && !event.shiftKey) { undo(); event.preventDefault(); }
      return;
    }
    // A button that has the focus is pressed by these.
    if (event.target instanceof HTMLButtonElement && (key === "Enter" || key === " ")) return;
    // So is the slider moved by these.
    if (event.target === $("light") && (key.startsWith("Arrow") || key.startsWith("Page") || key === "Home" || key === "End")) return;
    if (key >= "1" && key <= "9") {
      const index = Number(key) - 1;
      if (index < session.columns.length) choose(index);
      return;
    }
    const action = KEYS[key];
    if (!action) return;
    event.preventDefault();
    warn();
    // Held down, a key moves; it does not mark one column after the other.
    const moves = key.startsWith("Arrow") || key.startsWith("Page") || "np+-=bd".includes(key);
    if (!event.repeat || moves) action(event);
  });

  const BUTTONS = {
    previous: () => show(image - 1), next: () => show(image + 1), up: () => nudge(-1), down: () => nudge(1), accept,
    ground: () => andOn(0), skip: () => andOn("skip"), copy, clear: () => put(null), undo, suggest: toggleSuggestions,
    take: () => take(false), "zoom-in": () => zoom(1.5), "zoom-out": () => zoom(1 / 1.5),
    "zoom-fit": fit, "light-reset": () => light(0), "help-open": help,
  };
  for (const [id, action] of Object.entries(BUTTONS)) {
    $(id).addEventListener("click", (event) => {
      if (!session) return;
      warn();
      action();
      // Pressed with a pointer, it does not keep the keys for itself.
      if (event.detail > 0) event.currentTarget.blur();
    });
  }
  $("light").addEventListener("input", () => light($("light").valueAsNumber));
  // Moved with a pointer, it does not keep the keys for itself.
  for (const kind of ["pointerup", "pointercancel"]) $("light").addEventListener(kind, () => $("light").blur());
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
}

// Keeps the page as new as the run, part by part: what is open stays open, and what is scrolled stays where it is.

const $ = (id) => document.getElementById(id);
const report = $("report");
let revision = Number(report.dataset.revision);
let asking = null;   // what aborts the request under way

/// Pauses after requests that failed, in milliseconds; then it is given up.
const PAUSES = [500, 1000, 2000, 4000, 8000];
/// How soon a lost connection is worth a word.
const LOST_AFTER = 2;

// ---- from an old tree of nodes to a new one

const like = (old, fresh) => old.nodeType === fresh.nodeType && old.nodeName === fresh.nodeName
  && (old.id ?? "") === (fresh.id ?? "");

/// Makes a node equal to another one like it, with as few changes as there are differences.
function patch(old, fresh) {
  if (old.nodeType !== Node.ELEMENT_NODE) {
    if (old.data !== fresh.data) old.data = fresh.data;
    return;
  }
  for (const { name, value } of fresh.attributes) if (old.getAttribute(name) !== value) old.setAttribute(name, value);
  for (const { name } of [...old.attributes]) {
    const reader = name === "open" && old.nodeName === "DETAILS";
    if (!reader && !fresh.hasAttribute(name)) old.removeAttribute(name);
  }
  patchChildren(old, fresh);
}

function patchChildren(old, fresh) {
  let at = old.firstChild;
  for (const child of [...fresh.childNodes]) {
    let match = at;
    // What has a name is found again behind what has gone.
    if (child.id) while (match && !like(match, child)) match = match.nextSibling;
    if (!match || !like(match, child)) {
      old.insertBefore(child, at);
      continue;
    }
    for (; at !== match; at = drop(at));
    at = match.nextSibling;
    patch(match, child);
  }
  while (at) at = drop(at);
}

/// Removes a node; gives the one behind it.
function drop(node) {
  const next = node.nextSibling;
  node.remove();
  return next;
}

// ---- what is told

function show(news) {
  $("line").textContent = news.line;
  $("share").value = news.share;
  if (news.report !== null) {
    patchChildren(report, new DOMParser().parseFromString(news.report, "text/html").body);
    revision = news.revision;
    report.dataset.revision = revision;
  }
  const far = news.end === null ? `${Math.floor(100 * news.share)} %` : "ended";
  document.title = `${far}: ${report.querySelector("h1")?.textContent ?? ""}`;
  say(news.end === null ? "running" : "ended", news.end ?? "");
}

function lose() {
  $("line").textContent = $("line").textContent.replace(/, [^,]* left$/, "");
  say("lost", "The command does not answer: it has ended or was stopped. This is what it told last.");
}

function say(state, words) {
  $("live").dataset.state = state;
  if ($("note").textContent !== words) $("note").textContent = words;
}

// ---- asking

async function ask() {
  asking = new AbortController();
  const quiet = document.hidden ? "&quiet=true" : "";
  const answer = await fetch(`news?since=${revision}${quiet}`, { signal: asking.signal, cache: "no-store" });
  if (!answer.ok) throw new Error(`${answer.status}`);
  return answer.json();
}

async function follow() {
  let failures = 0;
  while (failures <= PAUSES.length) {
    try {
      const news = await ask();
      failures = 0;
      show(news);
      if (news.end !== null) return;
    } catch (error) {
      if (error.name === "AbortError") continue;
      failures += 1;
      if (failures >= LOST_AFTER) lose();
      await new Promise((done) => setTimeout(done, PAUSES[failures - 1] ?? 0));
    }
  }
}

// Whoever comes back to the page wants to see what is new at once.
document.addEventListener("visibilitychange", () => asking?.abort());
document.body.dataset.ready = "true";
if ($("live").dataset.state !== "ended") follow();

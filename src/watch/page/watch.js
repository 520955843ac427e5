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
  const have = [...old.childNodes], want = [...fresh.childNodes];
  const pairs = kept(have, want);
  const stay = new Set(pairs.values());
  for (const node of have) if (!stay.has(node)) node.remove();
  let at = old.firstChild;
  for (const child of want) {
    const match = pairs.get(child);
    if (!match) { old.insertBefore(child, at); continue; }
    at = match.nextSibling;
    patch(match, child);
  }
}

/// Which old node becomes which new one: as many as can, in their order, so that what comes or goes takes nothing behind it
/// along (a longest common subsequence).
function kept(have, want) {
  const pairs = new Map();
  let start = 0, a = have.length, b = want.length;
  for (; start < a && start < b && like(have[start], want[start]); start += 1) pairs.set(want[start], have[start]);
  for (; a > start && b > start && like(have[a - 1], want[b - 1]); a -= 1, b -= 1) pairs.set(want[b - 1], have[a - 1]);
  const most = Array.from({ length: a - start + 1 }, () => new Array(b - start + 1).fill(0));
  const of = (i, j) => most[i - start][j - start];
  for (let i = a - 1; i >= start; i -= 1) {
    for (let j = b - 1; j >= start; j -= 1) {
      most[i - start][j - start] = like(have[i], want[j]) ? 1 + of(i + 1, j + 1) : Math.max(of(i + 1, j), of(i, j + 1));
    }
  }
  for (let i = start, j = start; i < a && j < b;) {
    if (like(have[i], want[j])) { pairs.set(want[j], have[i]); i += 1; j += 1; }
    else if (of(i + 1, j) >= of(i, j + 1)) i += 1;
    else j += 1;
  }
  return pairs;
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

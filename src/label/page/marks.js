// The marks, and how they get to the disk. A mark is a row (a number), "skip", or null for none.

const key = (image, x) => `${x} ${image}`;

/// Milliseconds between two questions after what other windows have done, and the same in a window that is not seen.
const POLL = 1000;
const POLL_HIDDEN = 10000;
/// Milliseconds until the first try again after a failure; the next ones wait longer, up to the second number.
const RETRY = [400, 3000];
/// Changes sent at a time, so that a request stays far below what the server takes.
const BATCH = 100;
/// Milliseconds after which an answer is not waited for any longer; more than the server waits for its files.
const PATIENCE = 15000;

export class Marks extends EventTarget {
  #saved = new Map();    // what the server has, as far as this window knows
  #wanted = new Map();   // what it is to have: { image, x, from, also, to }, where `also` lists marks of this window
                         // that may be on the disk, for no answer came to them
  #sending = null;       // those under way
  #undo = [];
  #id = null;            // of the command as it was started
  #identity = null;      // of its folder
  #folder = "";
  #images = new Set();
  #columns = new Set();
  #retry = null;
  #revision = 0;
  #answers = 0;          // counts answers to changes, to tell news that were older
  #failures = 0;
  #since = 0;

  /// Asks for everything; the answer is what the page shows.
  async begin() {
    const answer = await this.#ask("session");
    if (this.#identity !== null && answer.identity !== this.#identity) {
      // Images of the same names may be in both.
      if (this.#wanted.size) throw new Error(this.#elsewhere(answer.folder));
      this.#undo = [];
    }
    this.#id = answer.id;
    this.#identity = answer.identity;
    this.#folder = answer.folder;
    this.#images = new Set(answer.images);
    this.#columns = new Set(answer.columns);
    this.#revision = answer.revision;
    this.#saved = new Map(answer.marks.filter((m) => m.mark !== null).map((m) => [key(m.image, m.x), m.mark]));
    if (!this.polling) this.#poll();
    this.polling = true;
    this.flush();
    return answer;
  }

  /// The mark as this window wants it.
  get(image, x) {
    const wanted = this.#wanted.get(key(image, x));
    return wanted ? wanted.to : this.#saved.get(key(image, x)) ?? null;
  }

  /// Marks that are not on the disk yet.
  get unsaved() { return this.#wanted.size; }

  /// What went wrong last time, while nothing can be saved.
  problem = null;

  /// How long the oldest unsaved mark has been waiting, in milliseconds.
  get waiting() { return this.#wanted.size ? performance.now() - this.#since : 0; }

  /// Sets marks, [{ image, x, to }], as one step that can be undone. `joined` makes it one step with the last one if
  /// that was about the same column. Gives how many were changed.
  set(changes, joined = false) {
    const step = changes
      .map(({ image, x, to }) => ({ image, x, from: this.get(image, x), to }))
      .filter(({ from, to }) => from !== to);
    if (!step.length) return 0;
    const last = this.#undo.at(-1);
    const same = joined && last?.joined && last.length === 1 && step.length === 1
      && last[0].image === step[0].image && last[0].x === step[0].x && last[0].to === step[0].from;
    if (same) {
      last[0].to = step[0].to;
      // There and back again is nothing to be undone.
      if (last[0].from === last[0].to) this.#undo.pop();
    } else this.#undo.push(Object.assign(step.map((c) => ({ ...c })), { joined }));
    this.#want(step);
    return step.length;
  }

  /// Takes the last step of this window back, where nobody has changed the marks since. Gives what was done.
  undo() {
    const step = this.#undo.pop();
    if (!step) return null;
    const back = step.filter((c) => this.get(c.image, c.x) === c.to).map((c) => ({ ...c, from: c.to, to: c.from }));
    this.#want(back);
    return { done: back, kept: step.length - back.length };
  }

  #want(changes) {
    if (!this.#wanted.size) this.#since = performance.now();
    for (const { image, x, from, to } of changes) {
      const there = this.#wanted.get(key(image, x));
      this.#wanted.set(key(image, x), { image, x, from: there ? there.from : from, also: there?.also ?? [], to });
    }
    this.#changed(changes);
    this.flush();
  }

  /// Tells that marks are others now, or how they are saved; of which images, if of any.
  #changed(cells = []) {
    this.dispatchEvent(new CustomEvent("change", { detail: new Set(cells.map((c) => c.image)) }));
  }

  #elsewhere(folder) {
    return `vsonar labels another folder now${folder ? `, ${folder}` : ""}; what is not saved belongs to ${this.#folder}: start vsonar label for that one again.`;
  }

  /// Whether the command takes a mark there.
  #asks({ image, x }) { return this.#images.has(image) && this.#columns.has(x); }

  #say(text) { this.dispatchEvent(new CustomEvent("say", { detail: text })); }

  /// Sends what is not saved; calls itself until nothing is left.
  async flush() {
    // One chain of tries, however many keys are pressed meanwhile.
    clearTimeout(this.#retry);
    if (this.#sending || !this.#wanted.size) return;
    // A mark that came back to what it was needs no saving, but only if nothing is or may be under way.
    for (const [k, { from, also, to }] of this.#wanted) if (from === to && !also.length) this.#wanted.delete(k);
    const ours = [...this.#wanted.values()].filter((c) => this.#asks(c));
    const marks = ours.slice(0, this.alone ? 1 : BATCH).map((c) => ({ ...c, also: [...c.also] }));
    if (!marks.length) {
      // After another start of the command: not lost, but for when it asks for them again.
      if (this.#wanted.size) this.problem = "vsonar was started again for other columns or images; start it with --columns that have them.";
      return this.#changed();
    }
    this.#sending = marks;
    let again = 0;
    try {
      const { refused } = await this.#ask("marks", { identity: this.#identity, marks });
      this.alone = false;
      this.#settle(marks, refused);
    } catch (error) {
      again = await this.#failed(marks, error);
    }
    this.#answers += 1;
    this.#sending = null;
    this.#changed(marks);
    if (again) this.#retry = setTimeout(() => this.flush(), again); else this.flush();
  }

  /// Sends what is left, without waiting for an answer: the window is being closed.
  leave() {
    // What is under way may come before these or after them.
    const underWay = new Map((this.#sending ?? []).map((c) => [key(c.image, c.x), c.to]));
    const left = [...this.#wanted.values()]
      .filter((c) => this.#asks(c))
      .map((c) => (underWay.has(key(c.image, c.x)) ? { ...c, also: [...c.also, underWay.get(key(c.image, c.x))] } : c))
      .filter(({ from, also, to }) => from !== to || also.length);
    for (let i = 0; i < left.length; i += BATCH) {
      this.#ask("marks", { identity: this.#identity, marks: left.slice(i, i + BATCH) }).catch(() => {});
    }
  }

  /// The server has these, but for those that it refused because they are others' now.
  #settle(marks, refused) {
    this.#failures = 0;
    this.problem = null;
    const others = new Map(refused.map((m) => [key(m.image, m.x), m.mark]));
    for (const { image, x, to } of marks) {
      const k = key(image, x);
      const other = others.has(k);
      const now = other ? others.get(k) : to;
      if (now === null) this.#saved.delete(k); else this.#saved.set(k, now);
      const wanted = this.#wanted.get(k);
      if (other || wanted.to === to) this.#wanted.delete(k); else Object.assign(wanted, { from: to, also: [] });
      if (other) {
        this.#undo = this.#undo
          .map((step) => Object.assign(step.filter((c) => c.image !== image || c.x !== x), { joined: step.joined }))
          .filter((step) => step.length);
        this.dispatchEvent(new CustomEvent("refused", { detail: { image, x, to, now } }));
      }
    }
  }

  /// Gives the time to wait before the next try.
  async #failed(marks, error) {
    if (error.refused) {
      // These can never be saved; of several, the wrong one is found alone.
      if (marks.length > 1) { this.alone = true; return 1; }
      // A command that was started again may ask for other columns, which is no reason to forget what was marked.
      const news = await this.#ask(`changes?since=${this.#revision}`).catch(() => null);
      if (news?.id !== this.#id) {
        this.dispatchEvent(new Event("restart"));
        return RETRY[0];
      }
      this.#wanted.delete(key(marks[0].image, marks[0].x));
      this.alone = false;
      this.#say(`Not saved: ${error.message}`);
      return 1;
    }
    if (error.elsewhere) {
      this.problem = this.#elsewhere("");
    } else {
      this.problem = error.message;
      // They may have been saved all the same.
      for (const { image, x, to } of marks) {
        const { also } = this.#wanted.get(key(image, x));
        if (!also.includes(to)) also.push(to);
      }
    }
    this.#failures += 1;
    return Math.min(RETRY[0] * 1.5 ** this.#failures, RETRY[1]);
  }

  async #poll() {
    const answers = this.#answers;
    try {
      const news = await this.#ask(`changes?since=${this.#revision}`);
      if (news.id !== this.#id) {
        // Another command answers under the same address.
        this.dispatchEvent(new Event("restart"));
      } else if (answers === this.#answers && !this.#sending) {
        this.#revision = news.revision;
        const others = [];
        for (const { image, x, mark } of news.marks) {
          if ((this.#saved.get(key(image, x)) ?? null) !== mark) others.push({ image });
          if (mark === null) this.#saved.delete(key(image, x)); else this.#saved.set(key(image, x), mark);
        }
        if (others.length) this.#changed(others);
      }
      if (this.problem && !this.#wanted.size) { this.problem = null; this.#failures = 0; this.#changed(); }
    } catch (error) {
      if (!this.problem) { this.problem = error.message; this.#changed(); }
    }
    const wait = document.hidden ? POLL_HIDDEN : POLL;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.#poll(), wait);
  }

  async #ask(what, body) {
    const signal = AbortSignal.timeout(PATIENCE);
    const options = body === undefined ? { signal } : {
      signal,
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body),
      // It is sent even if the window is closed at this moment.
      keepalive: true,
    };
    let answer;
    try {
      answer = await fetch(what, options);
    } catch {
      throw new Error("vsonar does not answer; is it still running?");
    }
    const content = await answer.json().catch(() => ({}));
    if (answer.ok) return content;
    const error = new Error(content.error ?? (answer.status === 403
      ? "the address is no longer valid: open the one that vsonar has printed" : `vsonar answers ${answer.status}`));
    error.refused = [400, 413, 415, 422].includes(answer.status);
    error.elsewhere = answer.status === 409;
    throw error;
  }

  /// Where an image is. Numbers mean others when the command is started again, which then refuses them.
  address(index) { return `image/${index}?id=${this.#id}`; }

  /// The detector's rows for an image.
  suggestions(index) { return this.#ask(`suggestions/${index}?id=${this.#id}`); }
}

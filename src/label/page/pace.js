// How fast marks are made, and so how long the rest will take.

/// A pause of more than this, in milliseconds, was not spent marking.
const PAUSE = 30000;

export class Pace {
  #times = [];  // of marks made in this window

  /// So many marks were made.
  note(count) { for (let i = 0; i < count; i += 1) this.#times.push(performance.now()); }

  /// So many of the last ones were taken back.
  forget(count) { this.#times.length = Math.max(this.#times.length - count, 0); }

  /// Seconds a mark took lately, pauses left out.
  get #seconds() {
    const recent = this.#times.slice(-60);
    if (recent.length < 6) return null;
    const gaps = recent.slice(1).map((time, i) => time - recent[i]).filter((gap) => gap < PAUSE);
    return gaps.length ? gaps.reduce((a, b) => a + b, 0) / gaps.length / 1000 : null;
  }

  /// How long so many marks will take, in words; nothing where it cannot be told.
  left(count) {
    const each = this.#seconds;
    if (!each || !count) return null;
    const seconds = each * count;
    if (seconds < 90) return `about ${Math.max(Math.round(seconds / 5) * 5, 5)} s left`;
    if (seconds < 5400) return `about ${Math.round(seconds / 60)} min left`;
    return `about ${(seconds / 3600).toFixed(1)} h left`;
  }
}

// Mouse and fingers on the image: dragging a mark, moving and zooming the view.

export class Pointers {
  /// The row under a pointer that is down, while a mark is dragged.
  drag = null;
  #canvas;
  #view;
  #page;             // begin(at): may a mark be dragged from this point of the image? put(row), inside(row), paint()
  #down = new Map();
  #pinch = null;

  constructor(canvas, view, page) {
    [this.#canvas, this.#view, this.#page] = [canvas, view, page];
    canvas.addEventListener("pointerdown", (event) => this.#press(event));
    canvas.addEventListener("pointermove", (event) => this.#move(event));
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => this.#lift(event));
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
  }

  /// Ends a drag without a mark: what it was about is no longer shown or chosen.
  release() { this.drag = this.#view.loupe = null; }

  #press(event) {
    if (event.button !== 0) return;
    this.#canvas.setPointerCapture(event.pointerId);
    this.#down.set(event.pointerId, event);
    if (this.#down.size === 2) {
      this.release();
      this.#pinch = this.#spread();
      return this.#page.paint();
    }
    if (this.#down.size > 1 || !this.#page.begin(this.#view.at(event.clientX, event.clientY))) return;
    this.#view.loupe = event.pointerType === "touch" || null;
    this.#dragTo(event);
  }

  #move(event) {
    if (!this.#down.has(event.pointerId)) return;
    this.#down.set(event.pointerId, event);
    if (this.#pinch && this.#down.size === 2) {
      const now = this.#spread();
      this.#view.pan(now.x - this.#pinch.x, now.y - this.#pinch.y);
      this.#view.zoomBy(now.distance / Math.max(this.#pinch.distance, 1), this.#view.at(now.x, now.y));
      this.#pinch = now;
      this.#page.paint();
    } else if (this.drag !== null) {
      this.#dragTo(event);
    }
  }

  #lift(event) {
    if (!this.#down.delete(event.pointerId)) return;
    if (this.#down.size < 2) this.#pinch = null;
    const placed = this.drag;
    this.release();
    if (placed !== null && event.type === "pointerup") this.#page.put(placed);
    this.#page.paint();
  }

  #wheel(event) {
    event.preventDefault();
    if (event.ctrlKey) this.#view.zoomBy(Math.exp(-event.deltaY / 200), this.#view.at(event.clientX, event.clientY));
    else this.#view.pan(-event.deltaX, -event.deltaY);
    this.#page.paint();
  }

  #dragTo(event) {
    const at = this.#view.at(event.clientX, event.clientY);
    // Pixels that can be told apart are pointed at; of smaller ones, the edge between floor and obstacle is.
    this.drag = this.#page.inside(this.#view.showsPixels ? Math.floor(at.y) : at.y - 1);
    this.#page.paint();
  }

  #spread() {
    const [a, b] = [...this.#down.values()];
    return { distance: Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY), x: (a.clientX + b.clientX) / 2, y: (a.clientY + b.clientY) / 2 };
  }
}

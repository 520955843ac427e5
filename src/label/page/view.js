// The image on one canvas, columns, marks and ghosts on another above it; zoom; where a pointer is.

const COLOURS = {
  mark: "#3ddc97", active: "#ffb627", before: "#c9adff", suggestion: "#ff7a70", line: "#ffffff70", halo: "#000000a0", skip: "#aab4be",
};
const MAX_SCALE = 40;

export class View {
  constructor(canvas, below) {
    this.canvas = canvas;
    this.below = below;             // has the pixels alone, so that marks keep their colours when these are brightened
    this.context = canvas.getContext("2d");
    this.pixels = below.getContext("2d");
    this.zoom = 1;
    this.image = null;
    this.awaited = "";              // name of the image that is not there yet
    this.size = { width: 1, height: 1 };
    this.centre = { x: 0.5, y: 0.5 };
    this.loupe = null;
  }

  /// Another size of the images, in pixels.
  resize(width, height) {
    this.size = { width, height };
    this.fit();
  }

  fit() {
    this.zoom = 1;
    this.centre = { x: this.size.width / 2, y: this.size.height / 2 };
  }

  /// Screen pixels for one of the image.
  get scale() {
    const { clientWidth, clientHeight } = this.canvas;
    const whole = Math.min((clientWidth - 16) / this.size.width, (clientHeight - 30) / this.size.height);
    return Math.max(whole, 0.05) * this.zoom;
  }

  /// Whether pixels of the image are so large that each can be pointed at.
  get showsPixels() { return this.scale >= 5; }

  /// Zooms by a factor about a point of the image.
  zoomBy(factor, about = this.centre) {
    const before = this.scale;
    const whole = before / this.zoom;
    this.zoom = Math.min(Math.max(this.zoom * factor, 1), Math.max(MAX_SCALE / whole, 1));
    const share = before / this.scale;
    this.centre = { x: about.x + (this.centre.x - about.x) * share, y: about.y + (this.centre.y - about.y) * share };
    this.hold();
  }

  /// Moves by so many screen pixels.
  pan(dx, dy) {
    this.centre.x -= dx / this.scale;
    this.centre.y -= dy / this.scale;
    this.hold();
  }

  /// Brings a point of the image into the middle part of the view.
  follow(x, y) {
    if (this.zoom === 1) return;
    const near = { x: this.canvas.clientWidth * 0.3 / this.scale, y: this.canvas.clientHeight * 0.3 / this.scale };
    this.centre.x = Math.min(Math.max(this.centre.x, x - near.x), x + near.x);
    this.centre.y = Math.min(Math.max(this.centre.y, y - near.y), y + near.y);
    this.hold();
  }

  /// Keeps the image in view.
  hold() {
    for (const [axis, side, room] of [["x", this.size.width, this.canvas.clientWidth], ["y", this.size.height, this.canvas.clientHeight]]) {
      const half = room / this.scale / 2;
      this.centre[axis] = half >= side / 2 ? side / 2 : Math.min(Math.max(this.centre[axis], half), side - half);
    }
  }

  /// A point of the screen in the image.
  at(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    return {
      x: (clientX - box.left - box.width / 2) / this.scale + this.centre.x,
      y: (clientY - box.top - box.height / 2) / this.scale + this.centre.y,
    };
  }

  /// Draws columns [{ x, mark, draft, active, before, suggestion }].
  draw(columns) {
    const { canvas, context: c } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    for (const one of [canvas, this.below]) {
      if (one.width !== Math.round(width * ratio) || one.height !== Math.round(height * ratio)) {
        one.width = Math.round(width * ratio);
        one.height = Math.round(height * ratio);
      }
    }
    for (const one of [c, this.pixels]) {
      one.setTransform(ratio, 0, 0, ratio, 0, 0);
      one.clearRect(0, 0, width, height);
    }
    const s = this.scale;
    const place = { s, left: width / 2 - this.centre.x * s, top: height / 2 - this.centre.y * s };
    this.#picture(place);
    const gap = columns.length > 1 ? Math.min(...columns.slice(1).map((col, i) => col.x - columns[i].x)) : this.size.width / 4;
    const reach = Math.max(5, Math.min(gap * s * 0.3, 26));
    for (const column of columns.filter((col) => !col.active)) this.#column(column, place, reach, columns.length);
    for (const column of columns.filter((col) => col.active)) this.#column(column, place, reach, columns.length);
    if (this.loupe) this.#loupe(place, columns.find((col) => col.active), width);
  }

  #picture({ s, left, top }) {
    if (!this.image) return;
    this.pixels.imageSmoothingEnabled = s < 1;
    this.pixels.drawImage(this.image, left, top, this.size.width * s, this.size.height * s);
  }

  #line(x0, y0, x1, y1, colour, width, dash = []) {
    const c = this.context;
    c.beginPath();
    c.moveTo(x0, y0);
    c.lineTo(x1, y1);
    c.lineCap = dash.length ? "butt" : "round";
    c.setLineDash([]);
    c.strokeStyle = COLOURS.halo;
    c.lineWidth = width + 2;
    if (!dash.length) c.stroke();
    c.setLineDash(dash);
    c.strokeStyle = colour;
    c.lineWidth = width;
    c.stroke();
    c.setLineDash([]);
  }

  #column(column, { s, left, top }, reach, count) {
    const c = this.context;
    const x = left + (column.x + 0.5) * s;
    const [first, last] = [top, top + this.size.height * s];
    const foot = (row) => row === 0 ? first : top + (row + 1) * s;
    const { mark, active } = column;
    // The pixel in question stays free of what marks it.
    const open = reach > 14 ? 6 : 0;
    this.#line(x, first, x, last, active ? "#ffb62790" : COLOURS.line, 1, mark === "skip" ? [3, 6] : []);
    if (typeof mark === "number") {
      const y = foot(mark);
      const colour = active ? COLOURS.active : COLOURS.mark;
      this.#line(x, Math.min(y + open, last), x, last, colour, 2);
      this.#tick(x, y, open, reach, colour, active ? 4 : 3);
      if (this.showsPixels && mark > 0) {
        c.lineWidth = 1.5;
        c.strokeStyle = colour;
        c.strokeRect(left + column.x * s, top + mark * s, s, s);
      }
    } else if (mark === "skip") {
      const y = (first + last) / 2;
      this.#line(x - 7, y - 7, x + 7, y + 7, active ? COLOURS.active : COLOURS.skip, 3);
      this.#line(x - 7, y + 7, x + 7, y - 7, active ? COLOURS.active : COLOURS.skip, 3);
    } else if (active) {
      const y = foot(column.draft);
      this.#line(x, Math.min(y + open, last), x, last, COLOURS.active, 2, [2, 5]);
      this.#tick(x, y, open, reach, COLOURS.halo, 4);
      this.#tick(x, y, open, reach, COLOURS.active, 3, [5, 3]);
    }
    if (typeof column.before === "number") this.#diamond(x - reach - 7, foot(column.before));
    if (typeof column.suggestion === "number") this.#triangle(x + reach + 4, foot(column.suggestion));
    this.#number(column, x, Math.min(last, this.canvas.clientHeight - 12), count);
  }

  #tick(x, y, open, reach, colour, width, dash) {
    this.#line(x - reach, y, x - open, y, colour, width, dash);
    this.#line(x + open, y, x + reach, y, colour, width, dash);
  }

  #diamond(x, y) {
    const c = this.context;
    c.beginPath();
    for (const [dx, dy] of [[0, -6], [6, 0], [0, 6], [-6, 0]]) c.lineTo(x + dx, y + dy);
    c.closePath();
    this.#outlined(COLOURS.before, false);
  }

  #triangle(x, y) {
    const c = this.context;
    c.beginPath();
    for (const [dx, dy] of [[0, 0], [11, -7], [11, 7]]) c.lineTo(x + dx, y + dy);
    c.closePath();
    this.#outlined(COLOURS.suggestion, true);
  }

  #outlined(colour, filled) {
    const c = this.context;
    c.lineWidth = 4;
    c.strokeStyle = COLOURS.halo;
    c.stroke();
    if (filled) { c.fillStyle = colour; c.fill(); }
    c.lineWidth = 2;
    c.strokeStyle = colour;
    c.stroke();
  }

  /// The column's number at its foot.
  #number({ number, active }, x, y, count) {
    if (count > 30) return;
    const c = this.context;
    c.font = "600 12px system-ui, sans-serif";
    c.textAlign = "center";
    c.textBaseline = "middle";
    c.beginPath();
    c.arc(x, y, 10, 0, 2 * Math.PI);
    c.fillStyle = active ? COLOURS.active : "#17202b";
    c.fill();
    c.fillStyle = active ? "#17202b" : "#e8edf2";
    c.fillText(number, x, y + 0.5);
  }

  /// What a finger hides, beside it.
  #loupe({ s, left, top }, column, width) {
    if (!this.image || !column) return;
    const c = this.context;
    const radius = 62;
    const row = typeof column.mark === "number" ? column.mark : column.draft;
    const [x, y] = [left + (column.x + 0.5) * s, top + (row + 0.5) * s];
    const cx = Math.min(Math.max(x + (x > width / 2 ? -110 : 110), radius + 4), width - radius - 4);
    const cy = Math.max(y - 90, radius + 4);
    const zoom = Math.max(s * 2.5, 8);
    for (const one of [c, this.pixels]) {
      one.save();
      one.beginPath();
      one.arc(cx, cy, radius, 0, 2 * Math.PI);
      one.clip();
      one.clearRect(cx - radius, cy - radius, 2 * radius, 2 * radius);
    }
    this.pixels.imageSmoothingEnabled = false;
    const [ox, oy] = [cx - (column.x + 0.5) * zoom, cy - (row + 1) * zoom];
    this.pixels.drawImage(this.image, ox, oy, this.size.width * zoom, this.size.height * zoom);
    this.pixels.restore();
    this.#line(cx, cy + 10, cx, cy + radius, COLOURS.active, 2);
    this.#tick(cx, cy, 10, 34, COLOURS.active, 3);
    c.restore();
    c.beginPath();
    c.arc(cx, cy, radius, 0, 2 * Math.PI);
    c.lineWidth = 3;
    c.strokeStyle = COLOURS.active;
    c.stroke();
  }
}

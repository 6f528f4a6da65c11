/** The part of the map that is looked at: where it is, and how large. North is up, y is up. */

const LARGEST_SCALE = 1500; // px per metre; a cell of 5 cm is then 75 px wide
const BORDER = 0.06; // share of the window left free around a fitted map

export class View {
  constructor() {
    this.width = 1;
    this.height = 1;
    this.scale = 40; // px per metre
    this.x = 0; // of the map, in the middle of the free part of the window
    this.y = 0;
    this.bounds = null; // {minX, minY, maxX, maxY} of the map
    this.covered = { left: 0, top: 0, right: 0, bottom: 0 }; // px under panels
    this.version = 0; // changes whenever anything above does
  }

  resize(width, height, covered) {
    Object.assign(this, { width, height, covered });
    this.version += 1;
  }

  get middle() {
    const { left, top, right, bottom } = this.covered;
    return [(left + this.width - right) / 2, (top + this.height - bottom) / 2];
  }

  toScreen(x, y) {
    const [u, v] = this.middle;
    return [u + (x - this.x) * this.scale, v - (y - this.y) * this.scale];
  }

  toMap(px, py) {
    const [u, v] = this.middle;
    return [this.x + (px - u) / this.scale, this.y - (py - v) / this.scale];
  }

  panBy(dx, dy) {
    this.lookAt(this.x - dx / this.scale, this.y + dy / this.scale);
  }

  lookAt(x, y) {
    const b = this.bounds;
    this.x = b ? Math.min(Math.max(x, b.minX), b.maxX) : x;
    this.y = b ? Math.min(Math.max(y, b.minY), b.maxY) : y;
    this.version += 1;
  }

  /** Zoom so that the place under a point of the window stays there. */
  zoomAt(px, py, factor) {
    const [x, y] = this.toMap(px, py);
    const smallest = this.bounds ? this.#fittingScale() / 3 : 1;
    this.scale = Math.min(Math.max(this.scale * factor, smallest), LARGEST_SCALE);
    const [nowX, nowY] = this.toMap(px, py);
    this.lookAt(this.x + x - nowX, this.y + y - nowY);
  }

  zoomBy(factor) {
    this.zoomAt(...this.middle, factor);
  }

  fit() {
    if (!this.bounds) return;
    this.scale = this.#fittingScale();
    const b = this.bounds;
    this.lookAt((b.minX + b.maxX) / 2, (b.minY + b.maxY) / 2);
  }

  #fittingScale() {
    const { left, top, right, bottom } = this.covered;
    const b = this.bounds;
    const wide = Math.max(this.width - left - right, 50) * (1 - 2 * BORDER);
    const high = Math.max(this.height - top - bottom, 50) * (1 - 2 * BORDER);
    return Math.min(wide / (b.maxX - b.minX), high / (b.maxY - b.minY), LARGEST_SCALE);
  }
}

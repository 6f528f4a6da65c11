/** The map, in the colours of the page, turned as its origin says. */

// Of the PNG of the server; values in between are occupancies.
const WALL_GREY = 40;
const UNKNOWN_GREY = 205;
const FREE_GREY = 255;
// Darker than this an obstacle is drawn, however few pixels it has.
const OBSTACLE_GREY = 150;

// A wall of one cell is at least this wide. Two pixels are never drawn as one.
const LEAST_WALL_PX = 2;
const BLOCKS = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512];

/** A grey map in the colours of a theme, at every scale: walls, free space, and nothing where it is unknown. */
export class ColouredMap {
  #levels = new Map(); // by block: canvas

  constructor(image, colours) {
    this.width = image.width;
    this.height = image.height;
    this.greys = greysOf(image);
    this.table = colourTable(colours);
  }

  /** The block of pixels that is drawn as one where a pixel has a size (px of the window). */
  blockFor(size) {
    return BLOCKS.find((block) => block * size >= LEAST_WALL_PX) ?? BLOCKS.at(-1);
  }

  /** A canvas with one pixel per block; the blocks begin at the lower-left corner of the image. */
  level(block) {
    if (!this.#levels.has(block)) this.#levels.set(block, this.#draw(block));
    return this.#levels.get(block);
  }

  #draw(block) {
    const canvas = document.createElement("canvas");
    canvas.width = Math.ceil(this.width / block);
    canvas.height = Math.ceil(this.height / block);
    const ctx = canvas.getContext("2d");
    const pixels = ctx.createImageData(canvas.width, canvas.height);
    const words = new Uint32Array(pixels.data.buffer);
    for (let row = 0; row < canvas.height; row++) {
      const bottom = this.height - (canvas.height - 1 - row) * block;
      for (let column = 0; column < canvas.width; column++) {
        words[row * canvas.width + column] = this.table[this.#pooled(column * block, bottom, block)];
      }
    }
    ctx.putImageData(pixels, 0, 0);
    return canvas;
  }

  /** The grey of a block: its darkest obstacle, or what most of it is. */
  #pooled(left, bottom, block) {
    const { width, greys } = this;
    if (block === 1) return greys[(bottom - 1) * width + left];
    const [right, top] = [Math.min(left + block, width), Math.max(bottom - block, 0)];
    let [darkest, unknown, sum] = [FREE_GREY, 0, 0];
    for (let y = top; y < bottom; y++) {
      for (let i = y * width + left; i < y * width + right; i++) {
        const grey = greys[i];
        if (grey < darkest) darkest = grey;
        if (grey === UNKNOWN_GREY) unknown += 1;
        else sum += grey;
      }
    }
    const count = (right - left) * (bottom - top);
    if (darkest < OBSTACLE_GREY) return darkest;
    return 2 * unknown > count ? UNKNOWN_GREY : Math.round(sum / (count - unknown));
  }
}

function greysOf(image) {
  const canvas = document.createElement("canvas");
  canvas.width = image.width;
  canvas.height = image.height;
  const ctx = canvas.getContext("2d", { willReadFrequently: true });
  ctx.drawImage(image, 0, 0);
  const words = new Uint32Array(ctx.getImageData(0, 0, image.width, image.height).data.buffer);
  return Uint8Array.from(words, (word) => word & 255);
}

function colourTable(colours) {
  const wall = channels(colours.wall);
  const free = channels(colours.free);
  const table = new Uint32Array(256);
  for (let grey = 0; grey < 256; grey++) {
    const share = Math.max((grey - WALL_GREY) / (FREE_GREY - WALL_GREY), 0);
    const [r, g, b] = wall.map((from, i) => Math.round(from + (free[i] - from) * share));
    table[grey] = grey === UNKNOWN_GREY ? 0 : ((255 << 24) | (b << 16) | (g << 8) | r) >>> 0;
  }
  return table;
}

function channels(hex) {
  return [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
}

/** The corners of a map as the smallest upright box around them. */
export function boundsOf(map) {
  const [x0, y0, yaw] = map.origin;
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  const [w, h] = [map.width * map.resolution, map.height * map.resolution];
  const corners = [[0, 0], [w, 0], [0, h], [w, h]];
  const xs = corners.map(([u, v]) => x0 + cos * u - sin * v);
  const ys = corners.map(([u, v]) => y0 + sin * u + cos * v);
  return {
    minX: Math.min(...xs), minY: Math.min(...ys), maxX: Math.max(...xs), maxY: Math.max(...ys),
  };
}

/** Draw the map; its lower-left corner is that of the image. */
export function drawMap(ctx, view, map, coloured) {
  const block = coloured.blockFor(view.scale * map.image.resolution);
  drawOver(ctx, view, map, coloured.level(block), block);
}

/** Draw an image over the map whose pixels are blocks of so many of its pixels. */
export function drawOver(ctx, view, map, image, block = 1) {
  const [x0, y0, yaw] = map.origin;
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  const side = block * map.image.resolution; // m
  const high = image.height * side;
  const [left, top] = view.toScreen(x0 - sin * high, y0 + cos * high);
  const size = view.scale * side;
  ctx.save();
  ctx.transform(size * cos, -size * sin, size * sin, size * cos, left, top);
  ctx.imageSmoothingEnabled = false; // it would make thin walls pale
  ctx.drawImage(image, 0, 0);
  ctx.restore();
}

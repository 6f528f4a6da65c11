/** The map, in the colours of the page, turned as its origin says. */

// Of the PNG of the server; values in between come from scaling.
const WALL_GREY = 40;
const UNKNOWN_GREY = 205;
const FREE_GREY = 255;
const CRISP_FROM = 1.5; // px of the window per px of the image: from here on cells have edges

/**
 * Colour a grey map: walls, free space, and transparent where the map is unknown.
 *
 * @returns {HTMLCanvasElement} the same size as the image
 */
export function colourMap(image, colours) {
  const canvas = document.createElement("canvas");
  canvas.width = image.width;
  canvas.height = image.height;
  const ctx = canvas.getContext("2d", { willReadFrequently: true });
  ctx.drawImage(image, 0, 0);
  const pixels = ctx.getImageData(0, 0, image.width, image.height);
  const words = new Uint32Array(pixels.data.buffer);
  const table = colourTable(colours);
  for (let i = 0; i < words.length; i++) words[i] = table[words[i] & 255];
  ctx.putImageData(pixels, 0, 0);
  return canvas;
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

/** Draw the map; `canvas` is what colourMap made: row 0 at the top, the lower-left corner the map's. */
export function drawMap(ctx, view, map, canvas) {
  const [x0, y0, yaw] = map.origin;
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  const high = canvas.height * map.image.resolution;
  const [left, top] = view.toScreen(x0 - sin * high, y0 + cos * high);
  const size = view.scale * map.image.resolution; // px of the window per px of the image
  ctx.save();
  ctx.transform(size * cos, -size * sin, size * sin, size * cos, left, top);
  ctx.imageSmoothingEnabled = size * devicePixelRatio < CRISP_FROM;
  ctx.imageSmoothingQuality = "medium";
  ctx.drawImage(canvas, 0, 0);
  ctx.restore();
}

/** The belief: the probability of all places as a heat layer over the map. */

const FAINTEST = 0.12; // opacity of a cell with hardly any mass
const STRONGEST = 0.85;

let cached = { heat: null, colour: "", canvas: null };

export function drawBelief(ctx, view, map, heat, colour) {
  if (cached.heat !== heat || cached.colour !== colour) {
    cached = { heat, colour, canvas: heatCanvas(heat, colour) };
  }
  const [x0, y0, yaw] = map.origin;
  const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
  const high = heat.height * heat.cell;
  const [left, top] = view.toScreen(x0 - sin * high, y0 + cos * high);
  const size = view.scale * heat.cell; // px of the window per cell
  ctx.save();
  ctx.transform(size * cos, -size * sin, size * sin, size * cos, left, top);
  ctx.imageSmoothingEnabled = false;
  ctx.drawImage(cached.canvas, 0, 0);
  ctx.restore();
}

/** One pixel per cell, row 0 at the top. */
function heatCanvas({ width, height, values }, colour) {
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  const ctx = canvas.getContext("2d");
  ctx.fillStyle = colour;
  values.forEach((value, i) => {
    if (value === 0) return;
    ctx.globalAlpha = FAINTEST + (STRONGEST - FAINTEST) * Math.sqrt(value / 255);
    ctx.fillRect(i % width, height - 1 - Math.floor(i / width), 1, 1);
  });
  return canvas;
}

/** Faint lines at round metres, and the length that the ruler shows. */

const LEAST_SPACING_PX = 50;
const STEPS_M = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500];

export function roundStep(view) {
  return STEPS_M.find((step) => step * view.scale >= LEAST_SPACING_PX) ?? STEPS_M.at(-1);
}

export function drawGrid(ctx, view, colours) {
  const step = roundStep(view);
  const [minX, maxY] = view.toMap(0, 0);
  const [maxX, minY] = view.toMap(view.width, view.height);
  ctx.beginPath();
  for (let x = Math.ceil(minX / step) * step; x <= maxX; x += step) {
    const px = Math.round(view.toScreen(x, 0)[0]) + 0.5;
    ctx.moveTo(px, 0);
    ctx.lineTo(px, view.height);
  }
  for (let y = Math.ceil(minY / step) * step; y <= maxY; y += step) {
    const py = Math.round(view.toScreen(0, y)[1]) + 0.5;
    ctx.moveTo(0, py);
    ctx.lineTo(view.width, py);
  }
  ctx.strokeStyle = colours.grid;
  ctx.lineWidth = 1;
  ctx.stroke();
}

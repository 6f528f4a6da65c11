/** The goal of a simulated robot, and the rest of the path that leads there. */

export function drawGoal(ctx, view, goal, path, pose, colours) {
  if (path.length > 1 && pose) drawPath(ctx, view, restOf(path, pose), colours);
  drawFlag(ctx, ...view.toScreen(...goal), colours);
}

/** The corners of a path that are still ahead of a pose, from the pose on. */
function restOf(path, [x, y]) {
  let [nearest, ahead] = [Infinity, 1];
  for (let i = 1; i < path.length; i++) {
    const away = distance(path[i - 1], path[i], x, y);
    if (away <= nearest) [nearest, ahead] = [away, i];
  }
  return [[x, y], ...path.slice(ahead)];
}

/** From a point to a piece of the path. */
function distance([ax, ay], [bx, by], x, y) {
  const [dx, dy] = [bx - ax, by - ay];
  const along = ((x - ax) * dx + (y - ay) * dy) / Math.max(dx * dx + dy * dy, 1e-9);
  const share = Math.min(Math.max(along, 0), 1);
  return Math.hypot(x - ax - share * dx, y - ay - share * dy);
}

function drawPath(ctx, view, path, colours) {
  ctx.beginPath();
  path.forEach(([x, y], i) => (i ? ctx.lineTo(...view.toScreen(x, y)) : ctx.moveTo(...view.toScreen(x, y))));
  ctx.strokeStyle = colours.goal;
  ctx.lineWidth = 2.5;
  ctx.lineJoin = ctx.lineCap = "round";
  ctx.setLineDash([1, 7]);
  ctx.stroke();
  ctx.setLineDash([]);
}

export function drawFlag(ctx, px, py, colours) {
  ctx.save();
  ctx.translate(px, py);
  ctx.strokeStyle = ctx.fillStyle = colours.goal;
  ctx.lineWidth = 2.2;
  ctx.lineJoin = ctx.lineCap = "round";
  ctx.beginPath();
  ctx.ellipse(0, 0, 9, 4, 0, 0, 2 * Math.PI);
  ctx.globalAlpha = 0.3;
  ctx.fill();
  ctx.globalAlpha = 1;
  ctx.stroke();
  ctx.beginPath();
  ctx.moveTo(0, 0);
  ctx.lineTo(0, -26);
  ctx.lineTo(16, -20);
  ctx.lineTo(0, -14);
  ctx.closePath();
  ctx.fill();
  ctx.stroke();
  ctx.restore();
}

/** The robot at its pose with the uncertainty, and the true pose of a simulated robot. */

const RADIUS_M = 0.18;
const LEAST_RADIUS_PX = 9;
const SIGMAS = 2;
const CONE_M = 1.1;
const LEAST_CONE_PX = 34;

export function robotRadius(view) {
  return Math.max(RADIUS_M * view.scale, LEAST_RADIUS_PX);
}

export function drawRobot(ctx, view, { pose, covariance, chosen_by: chosenBy }, colours) {
  const colour = chosenBy ? colours.chosen : colours.robot;
  const [px, py] = view.toScreen(pose[0], pose[1]);
  const radius = robotRadius(view);
  ctx.save();
  ctx.translate(px, py);
  if (covariance) drawHeadingSpread(ctx, view, pose[2], covariance[3], radius, colour);
  ctx.save();
  ctx.rotate(-pose[2]);
  drawBody(ctx, radius, colour, colours["robot-ink"]);
  ctx.restore();
  if (covariance) drawEllipse(ctx, view, covariance, colours);
  ctx.restore();
}

function drawBody(ctx, radius, colour, ink) {
  ctx.beginPath();
  ctx.arc(0, 0, radius, 0, 2 * Math.PI);
  ctx.fillStyle = colour;
  ctx.globalAlpha = radius > 24 ? 0.6 : 1; // close by, the particles stay visible below
  ctx.fill();
  ctx.globalAlpha = 1;
  ctx.lineWidth = Math.max(1.5, radius * 0.1);
  ctx.strokeStyle = ink;
  ctx.stroke();
  drawArrowhead(ctx, radius * 0.62);
  ctx.fillStyle = ink;
  ctx.fill();
}

/** A path that points along +x, about the origin. */
export function drawArrowhead(ctx, size) {
  ctx.beginPath();
  ctx.moveTo(size, 0);
  ctx.lineTo(-0.62 * size, 0.72 * size);
  ctx.lineTo(-0.3 * size, 0);
  ctx.lineTo(-0.62 * size, -0.72 * size);
  ctx.closePath();
}

function drawEllipse(ctx, view, [xx, xy, yy], colours) {
  const mean = (xx + yy) / 2;
  const spread = Math.hypot((xx - yy) / 2, xy);
  const long = SIGMAS * Math.sqrt(Math.max(mean + spread, 0)) * view.scale;
  const short = SIGMAS * Math.sqrt(Math.max(mean - spread, 0)) * view.scale;
  const isEnlarged = RADIUS_M * view.scale < LEAST_RADIUS_PX;
  if (isEnlarged && long < robotRadius(view)) return; // inside a symbol it would only hide it
  ctx.beginPath();
  ctx.ellipse(0, 0, long, Math.max(short, 0.5), -Math.atan2(2 * xy, xx - yy) / 2, 0, 2 * Math.PI);
  ctx.fillStyle = colours.short;
  ctx.strokeStyle = colours.short;
  ctx.globalAlpha = 0.18;
  if (long > robotRadius(view)) ctx.fill();
  ctx.globalAlpha = 1;
  ctx.lineWidth = 1.5;
  ctx.stroke();
}

function drawHeadingSpread(ctx, view, yaw, variance, radius, colour) {
  const half = Math.min(Math.max(SIGMAS * Math.sqrt(Math.max(variance, 0)), 0.01), Math.PI);
  const reach = Math.max(CONE_M * view.scale, LEAST_CONE_PX, 1.6 * radius);
  ctx.beginPath();
  ctx.moveTo(0, 0);
  ctx.arc(0, 0, reach, -yaw - half, -yaw + half);
  ctx.closePath();
  ctx.fillStyle = ctx.strokeStyle = colour;
  ctx.lineWidth = 1.25;
  ctx.globalAlpha = 0.3;
  ctx.fill();
  ctx.stroke();
  ctx.globalAlpha = 1;
}

/** The true pose of the simulated robot: an outline only. */
export function drawTruth(ctx, view, pose, colours) {
  const radius = robotRadius(view) + 3.5;
  ctx.save();
  ctx.translate(...view.toScreen(pose[0], pose[1]));
  ctx.rotate(-pose[2]);
  ctx.strokeStyle = colours.truth;
  ctx.globalAlpha = 0.75;
  ctx.lineWidth = 1.5;
  ctx.setLineDash([4, 3]);
  ctx.beginPath();
  ctx.arc(0, 0, radius, 0, 2 * Math.PI);
  ctx.stroke();
  ctx.setLineDash([]);
  ctx.beginPath();
  ctx.moveTo(radius, 0);
  ctx.lineTo(radius + 7, 0);
  ctx.stroke();
  ctx.restore();
}

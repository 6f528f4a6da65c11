/** A plain AMCL beside the localizer: a square with a dashed ellipse, never a disc. */

import { robotRadius } from "./robot.js";

const SIGMAS = 2;
const FONT = "600 12px system-ui, sans-serif";

export function drawAmcl(ctx, view, { pose, covariance }, colours) {
  const radius = robotRadius(view);
  ctx.save();
  ctx.translate(...view.toScreen(pose[0], pose[1]));
  ctx.strokeStyle = ctx.fillStyle = colours.amcl;
  drawEllipse(ctx, view, covariance);
  ctx.save();
  ctx.rotate(-pose[2]);
  ctx.lineWidth = 2.5;
  ctx.beginPath();
  ctx.rect(-radius, -radius, 2 * radius, 2 * radius);
  ctx.moveTo(0, 0);
  ctx.lineTo(radius + 8, 0);
  ctx.globalAlpha = 0.18;
  ctx.fill();
  ctx.globalAlpha = 1;
  ctx.stroke();
  ctx.restore();
  drawName(ctx, radius, colours);
  ctx.restore();
}

function drawEllipse(ctx, view, [xx, xy, yy]) {
  const mean = (xx + yy) / 2;
  const spread = Math.hypot((xx - yy) / 2, xy);
  const long = SIGMAS * Math.sqrt(Math.max(mean + spread, 0)) * view.scale;
  const short = SIGMAS * Math.sqrt(Math.max(mean - spread, 0)) * view.scale;
  ctx.beginPath();
  ctx.ellipse(0, 0, long, short, -Math.atan2(2 * xy, xx - yy) / 2, 0, 2 * Math.PI);
  ctx.lineWidth = 1.5;
  ctx.setLineDash([6, 4]);
  ctx.stroke();
  ctx.setLineDash([]);
}

function drawName(ctx, radius, colours) {
  const y = -1.5 * radius - 14;
  ctx.font = FONT;
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  const width = ctx.measureText("AMCL").width + 12;
  ctx.beginPath();
  ctx.roundRect(-width / 2, y - 9.5, width, 18, 9);
  ctx.fillStyle = colours.surface;
  ctx.globalAlpha = 0.92;
  ctx.fill();
  ctx.globalAlpha = 1;
  ctx.fillStyle = colours.amcl;
  ctx.fillText("AMCL", 0, y);
}

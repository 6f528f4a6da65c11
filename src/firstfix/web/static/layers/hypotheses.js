/** Hypotheses: numbered places where the robot may be, with their probabilities. */

import { percent } from "../format.js";
import { groupsOf } from "./groups.js";
import { robotRadius } from "./robot.js";

const FONT = "600 12px system-ui, sans-serif";
const UNLIKELY = 0.01; // below this probability a hypothesis is small and has no number, unless it is highlighted

export function drawHypotheses(ctx, view, hypotheses, highlighted, colours) {
  // The most likely last, so that it lies on top.
  for (const { first, index, members, probability } of groupsOf(view, hypotheses).reverse()) {
    const isHighlighted = members.some(({ id }) => id === highlighted);
    drawHypothesis(ctx, view, { pose: first.pose, probability }, index, members.length, isHighlighted, colours);
  }
}

function drawHypothesis(ctx, view, { pose, probability }, index, count, isHighlighted, colours) {
  const isUnlikely = probability < UNLIKELY && !isHighlighted;
  const radius = isUnlikely ? 5 : Math.max(robotRadius(view), 11);
  ctx.save();
  ctx.translate(...view.toScreen(pose[0], pose[1]));
  ctx.strokeStyle = ctx.fillStyle = colours.hypothesis;
  if (isUnlikely) {
    ctx.globalAlpha = 0.55;
    drawPointer(ctx, pose[2], radius, isHighlighted);
    ctx.restore();
    return;
  }
  drawPointer(ctx, pose[2], radius, isHighlighted);
  drawDisc(ctx, radius, isHighlighted, colours);
  ctx.font = FONT;
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  ctx.fillStyle = isHighlighted ? colours["on-accent"] : colours.hypothesis;
  ctx.fillText(String(index + 1), 0, 0.5);
  const label = count > 1 ? `${count} places · ${percent(probability)}` : percent(probability);
  drawLabel(ctx, label, radius, pose[2], colours);
  ctx.restore();
}

function drawPointer(ctx, yaw, radius, isHighlighted) {
  ctx.save();
  ctx.rotate(-yaw);
  ctx.beginPath();
  const wide = Math.min(6, radius);
  ctx.moveTo(radius + 9, 0);
  ctx.lineTo(radius - 1, wide);
  ctx.lineTo(radius - 1, -wide);
  ctx.closePath();
  ctx.fill();
  if (isHighlighted) {
    ctx.globalAlpha = 0.25;
    ctx.beginPath();
    ctx.arc(0, 0, radius + 14, 0, 2 * Math.PI);
    ctx.fill();
  }
  ctx.restore();
}

function drawDisc(ctx, radius, isHighlighted, colours) {
  ctx.beginPath();
  ctx.arc(0, 0, radius, 0, 2 * Math.PI);
  ctx.fillStyle = isHighlighted ? colours.hypothesis : colours.surface;
  ctx.globalAlpha = isHighlighted ? 1 : 0.88;
  ctx.fill();
  ctx.globalAlpha = 1;
  ctx.lineWidth = 2;
  ctx.setLineDash(isHighlighted ? [] : [4, 3]);
  ctx.stroke();
  ctx.setLineDash([]);
}

/** The label is behind the robot, where its pointer is not. */
function drawLabel(ctx, text, radius, yaw, colours) {
  const below = Math.sin(yaw) > -0.2;
  const y = (below ? 1 : -1) * (radius + 13);
  const width = ctx.measureText(text).width + 12;
  ctx.beginPath();
  ctx.roundRect(-width / 2, y - 9.5, width, 18, 9);
  ctx.fillStyle = colours.surface;
  ctx.globalAlpha = 0.92;
  ctx.fill();
  ctx.globalAlpha = 1;
  ctx.fillStyle = colours.hypothesis;
  ctx.fillText(text, 0, y);
}

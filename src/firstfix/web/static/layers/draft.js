/** The command that is being drawn: a pose, a place to set the robot down, a goal. */

import { heading, metres } from "../format.js";
import { drawFlag } from "./goal.js";
import { drawArrowhead, robotRadius } from "./robot.js";

const ARROW_PX = 58;

export function drawDraft(ctx, view, draft, colours) {
  const [px, py] = view.toScreen(draft.x, draft.y);
  if (draft.kind === "goal") {
    drawFlag(ctx, px, py, colours);
    drawTag(ctx, px, py + 26, `${metres(draft.x)}, ${metres(draft.y)} m`, colours);
    return;
  }
  const radius = Math.max(robotRadius(view), 11);
  const colour = draft.kind === "carry" ? colours.short : colours.robot;
  const reach = Math.max(ARROW_PX, radius + 30);
  ctx.save();
  ctx.translate(px, py);
  ctx.rotate(-draft.yaw);
  ctx.strokeStyle = ctx.fillStyle = colour;
  ctx.lineWidth = 3;
  ctx.lineCap = "round";
  ctx.beginPath();
  ctx.arc(0, 0, radius, 0, 2 * Math.PI);
  ctx.globalAlpha = 0.25;
  ctx.fill();
  ctx.globalAlpha = 1;
  ctx.stroke();
  ctx.beginPath();
  ctx.moveTo(0, 0);
  ctx.lineTo(reach - 8, 0);
  ctx.stroke();
  ctx.translate(reach, 0);
  drawArrowhead(ctx, 13);
  ctx.fill();
  ctx.restore();
  const text = `${metres(draft.x)}, ${metres(draft.y)} m · ${heading(draft.yaw)}`;
  const below = Math.sin(draft.yaw) > -0.3;
  drawTag(ctx, px, py + (below ? 1 : -1) * (radius + 22), text, colours);
}

function drawTag(ctx, px, py, text, colours) {
  ctx.font = "600 12px system-ui, sans-serif";
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  const width = ctx.measureText(text).width + 16;
  ctx.beginPath();
  ctx.roundRect(px - width / 2, py - 11, width, 22, 11);
  ctx.fillStyle = colours.surface;
  ctx.globalAlpha = 0.94;
  ctx.fill();
  ctx.globalAlpha = 1;
  ctx.fillStyle = colours.text;
  ctx.fillText(text, px, py + 0.5);
}

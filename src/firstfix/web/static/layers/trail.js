/** The path of the robot; older parts are fainter. */

const PARTS = 5;

export function drawTrail(ctx, view, trail, colours) {
  ctx.strokeStyle = colours.trail;
  ctx.lineWidth = 2;
  ctx.lineJoin = ctx.lineCap = "round";
  const perPart = Math.ceil(trail.length / PARTS);
  for (let part = 0; part < PARTS; part++) {
    ctx.globalAlpha = 0.12 + (0.45 * part) / (PARTS - 1);
    ctx.beginPath();
    strokeBetween(ctx, view, trail, part * perPart, (part + 1) * perPart);
    ctx.stroke();
  }
  ctx.globalAlpha = 1;
}

function strokeBetween(ctx, view, trail, from, to) {
  let down = false;
  for (let i = from; i <= Math.min(to, trail.length - 1); i++) {
    if (trail[i] === null) {
      down = false;
      continue;
    }
    const [px, py] = view.toScreen(...trail[i]);
    if (down) ctx.lineTo(px, py);
    else ctx.moveTo(px, py);
    down = true;
  }
}

/** The live scan: the class of each beam, by colour and by shape. */

const EXPLAINED = 0;
const SHORT = 1;
const THROUGH_WALL = 2;
const UNKNOWN = 3; // 4, a beam without return, has no end to draw

// Dots first: evidence against the pose must not hide under them.
const ORDER = [UNKNOWN, EXPLAINED, SHORT, THROUGH_WALL];
const COLOURS = ["explained", "short", "through-wall", "unknown"];

export function drawScan(ctx, view, scan, colours) {
  const size = Math.min(Math.max(view.scale * 0.035, 1.7), 5);
  for (const kind of ORDER) {
    ctx.beginPath();
    const outlined = kind === THROUGH_WALL || kind === UNKNOWN;
    addMarks(ctx, view, scan, kind, outlined ? size + 0.8 : size);
    const colour = colours[COLOURS[kind]];
    if (outlined) {
      ctx.strokeStyle = colour;
      ctx.lineWidth = kind === THROUGH_WALL ? 1.8 : 1.2;
      ctx.stroke();
    } else {
      ctx.fillStyle = colour;
      ctx.fill();
    }
  }
}

/** The areas that the sensors see, each as one faint shape around the robot in its own shade. */
export function drawFieldOfView(ctx, view, scan, pose, colours) {
  const { values, count, sensors } = scan;
  if (count < 3) return;
  let start = 0;
  while (start < count) {
    const sensor = sensors ? sensors[start] : 0;
    let end = start;
    ctx.beginPath();
    ctx.moveTo(...view.toScreen(pose[0], pose[1]));
    for (; end < count && (!sensors || sensors[end] === sensor); end++) {
      ctx.lineTo(...view.toScreen(values[2 * end], values[2 * end + 1]));
    }
    ctx.closePath();
    ctx.fillStyle = sensor % 2 === 0 ? colours.robot : colours.short;
    ctx.globalAlpha = 0.07;
    ctx.fill();
    start = end;
  }
  ctx.globalAlpha = 1;
}

function addMarks(ctx, view, { values, classes, count }, kind, size) {
  const [u, v] = view.toScreen(0, 0);
  const scale = view.scale;
  const mark = [addDot, addTriangle, addCross, addRing][kind];
  for (let i = 0; i < count; i++) {
    if (classes[i] !== kind) continue;
    const px = u + values[2 * i] * scale;
    const py = v - values[2 * i + 1] * scale;
    if (px < -9 || py < -9 || px > view.width + 9 || py > view.height + 9) continue;
    mark(ctx, px, py, size);
  }
}

function addDot(ctx, px, py, size) {
  if (size < 2.4) ctx.rect(px - size, py - size, 2 * size, 2 * size);
  else addRing(ctx, px, py, size);
}

function addRing(ctx, px, py, size) {
  ctx.moveTo(px + size, py);
  ctx.arc(px, py, size, 0, 2 * Math.PI);
}

function addTriangle(ctx, px, py, size) {
  ctx.moveTo(px, py - 1.4 * size);
  ctx.lineTo(px + 1.3 * size, py + size);
  ctx.lineTo(px - 1.3 * size, py + size);
  ctx.closePath();
}

function addCross(ctx, px, py, size) {
  ctx.moveTo(px - size, py - size);
  ctx.lineTo(px + size, py + size);
  ctx.moveTo(px + size, py - size);
  ctx.lineTo(px - size, py + size);
}

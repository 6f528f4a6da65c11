/** Particles: a tick each, in the direction of the heading. */

const TICK_M = 0.12;
const SHORTEST_PX = 2.5;
const LONGEST_PX = 14;

export function drawParticles(ctx, view, particles, colours) {
  const { values, count } = particles;
  const tick = Math.min(Math.max(TICK_M * view.scale, SHORTEST_PX), LONGEST_PX);
  const [u, v] = view.toScreen(0, 0);
  const scale = view.scale;
  ctx.beginPath();
  for (let i = 0; i < 3 * count; i += 3) {
    const px = u + values[i] * scale;
    const py = v - values[i + 1] * scale;
    if (px < 0 || py < 0 || px > view.width || py > view.height) continue;
    ctx.moveTo(px, py);
    ctx.lineTo(px + tick * Math.cos(values[i + 2]), py - tick * Math.sin(values[i + 2]));
  }
  ctx.strokeStyle = colours.particle;
  ctx.lineWidth = 1.25;
  ctx.globalAlpha = 0.55;
  ctx.stroke();
  ctx.globalAlpha = 1;
}

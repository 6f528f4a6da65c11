/** Two canvases, one for the map and one for what moves on it; drawn only after a change. */

import { drawAmcl } from "./layers/amcl.js";
import { drawBelief } from "./layers/belief.js";
import { drawChanges } from "./layers/changes.js";
import { drawDraft } from "./layers/draft.js";
import { drawGoal } from "./layers/goal.js";
import { drawGrid } from "./layers/grid.js";
import { drawHypotheses } from "./layers/hypotheses.js";
import { ColouredMap, drawMap } from "./layers/map.js";
import { drawParticles } from "./layers/particles.js";
import { drawRobot, drawTruth } from "./layers/robot.js";
import { drawScan, drawFieldOfView } from "./layers/scan.js";
import { drawTrail } from "./layers/trail.js";

export class Renderer {
  #ground = document.getElementById("ground");
  #overlay = document.getElementById("overlay");
  #coloured = null; // the map in the colours of the theme
  #drawnVersion = -1;
  #requested = false;
  #changed = true;

  constructor(view, scene, colours, onFrame) {
    Object.assign(this, { view, scene, colours, onFrame });
  }

  /** Fit the canvases to the window. */
  resize(covered) {
    const { clientWidth: width, clientHeight: height } = this.#overlay.parentElement;
    this.view.resize(width, height, covered);
    this.invalidate();
    const [wide, high] = [width, height].map((side) => Math.round(side * devicePixelRatio));
    if (this.#overlay.width === wide && this.#overlay.height === high) return;
    for (const canvas of [this.#ground, this.#overlay]) {
      canvas.width = wide;
      canvas.height = high;
    }
    this.#frame(performance.now()); // a new size clears a canvas, which must not be visible
  }

  /** The colours or the map changed. */
  recolour() {
    this.#coloured = this.scene.image ? new ColouredMap(this.scene.image, this.colours) : null;
    this.#drawnVersion = -1;
    this.invalidate();
  }

  /** Something on the map changed; it is drawn in the next animation frame. */
  invalidate() {
    this.#changed = true;
    if (this.#requested) return;
    this.#requested = true;
    requestAnimationFrame((now) => {
      this.#requested = false;
      this.#frame(now);
    });
  }

  #frame(now) {
    this.onFrame(now);
    if (this.#drawnVersion !== this.view.version) {
      this.#drawnVersion = this.view.version;
      this.#changed = true;
      this.#drawGround();
    }
    if (this.#changed) this.#drawOverlay();
    this.#changed = false;
  }

  #drawGround() {
    const { view, colours, scene } = this;
    const ctx = cleared(this.#ground, view);
    drawGrid(ctx, view, colours);
    if (scene.image && this.#coloured) drawMap(ctx, view, scene.map, this.#coloured);
  }

  #drawOverlay() {
    const { view, colours, scene } = this;
    const { state, shown, hypotheses } = scene;
    const ctx = cleared(this.#overlay, view);
    const pose = state?.pose ?? null;
    if (scene.isLive && scene.changes?.image) drawChanges(ctx, view, scene.map, scene.changes.image);
    if (shown.belief && scene.heat && scene.map) drawBelief(ctx, view, scene.map, scene.heat, colours.hypothesis);
    if (shown.scan && scene.scan && pose) drawFieldOfView(ctx, view, scene.scan, pose, colours);
    if (shown.trail && scene.trail.length) drawTrail(ctx, view, scene.trail, colours);
    if (shown.scan && scene.scan) drawScan(ctx, view, scene.scan, colours);
    if (shown.particles && scene.particles) drawParticles(ctx, view, scene.particles, colours);
    if (scene.goal) drawGoal(ctx, view, scene.goal, scene.path, pose, colours);
    if (shown.truth && state?.truth) drawTruth(ctx, view, state.truth, colours);
    if (state?.amcl) drawAmcl(ctx, view, state.amcl, colours);
    if (pose) drawRobot(ctx, view, state, colours);
    if (hypotheses.length) drawHypotheses(ctx, view, hypotheses, scene.highlighted, colours);
    if (scene.draft) drawDraft(ctx, view, scene.draft, colours);
  }
}

function cleared(canvas, view) {
  const ctx = canvas.getContext("2d");
  const ratio = canvas.width / view.width;
  ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
  ctx.clearRect(0, 0, view.width, view.height);
  return ctx;
}

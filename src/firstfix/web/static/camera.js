/** The view: fit, follow, zoom, and the ruler with its scale. */

import { roundStep } from "./layers/grid.js";

const FOLLOW_SCALE = 45; // px per metre, at least, while the robot is followed
const EASE_MS = 140;
const LET_GO_PX = 60; // dragging the robot this far from the middle ends following
const BUTTON_ZOOM = 1.4;
const SEPARATE_PX = 60; // from one place to the next, so that their symbols do not overlap
const INSEPARABLE_M = 0.1; // zooming does not help below this distance

const byId = (id) => document.getElementById(id);

export class Camera {
  #follows = false;
  #framedAt = 0;
  #shownScale = 0;
  #calm = matchMedia("(prefers-reduced-motion: reduce)");

  constructor(view, scene, onChange) {
    Object.assign(this, { view, scene, onChange });
    byId("zoom-in").addEventListener("click", () => this.zoom(BUTTON_ZOOM));
    byId("zoom-out").addEventListener("click", () => this.zoom(1 / BUTTON_ZOOM));
    byId("fit").addEventListener("click", () => this.fit());
    byId("follow").addEventListener("click", () => this.toggleFollow());
  }

  fit() {
    this.#setFollow(false);
    this.view.fit();
    this.onChange();
  }

  zoom(factor) {
    this.view.zoomBy(factor);
    this.onChange();
  }

  /** Zoom in until places that overlap do not; false if they are too near to each other. */
  separate(places) {
    const [[x, y], ...others] = places.map(({ pose }) => pose);
    const nearest = Math.min(...others.map((pose) => Math.hypot(pose[0] - x, pose[1] - y)));
    if (nearest < INSEPARABLE_M) return false;
    this.#setFollow(false);
    this.view.lookAt(x, y);
    this.zoom(Math.max(SEPARATE_PX / (nearest * this.view.scale), BUTTON_ZOOM));
    return true;
  }

  toggleFollow() {
    this.#setFollow(!this.#follows);
  }

  /** The map was moved by hand. */
  movedByHand() {
    const pose = this.scene.state?.pose;
    if (this.#follows && pose) {
      const [px, py] = this.view.toScreen(pose[0], pose[1]);
      const [u, v] = this.view.middle;
      if (Math.hypot(px - u, py - v) > LET_GO_PX) this.#setFollow(false);
    }
    this.onChange();
  }

  /** Before each frame of the screen. */
  frame(now) {
    const elapsed = Math.min(now - this.#framedAt, 100);
    this.#framedAt = now;
    if (this.#follows && this.scene.state?.pose) this.#glide(this.scene.state.pose, elapsed);
    this.#showRuler();
  }

  /** Poses arrive 20 times a second; the screen is drawn more often. */
  #glide([x, y], elapsed) {
    const { view } = this;
    const [dx, dy] = [x - view.x, y - view.y];
    const far = Math.hypot(dx, dy) * view.scale;
    if (far < 0.3) return;
    const jumps = this.#calm.matches || far > view.width;
    const share = jumps ? 1 : 1 - Math.exp(-elapsed / EASE_MS);
    view.lookAt(view.x + dx * share, view.y + dy * share);
    this.onChange();
  }

  #setFollow(on) {
    this.#follows = on;
    byId("follow").setAttribute("aria-pressed", String(on));
    if (on && this.view.scale < FOLLOW_SCALE) this.view.zoomBy(FOLLOW_SCALE / this.view.scale);
    this.onChange();
  }

  #showRuler() {
    const { scale } = this.view;
    if (scale === this.#shownScale) return;
    this.#shownScale = scale;
    const step = roundStep(this.view);
    byId("ruler-bar").style.width = `${step * scale}px`;
    byId("ruler-text").textContent = step < 1 ? `${Math.round(100 * step)} cm` : `${step} m`;
  }
}

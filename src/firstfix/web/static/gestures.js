/** Pointers on the map: pan, wheel, pinch; in a mode, press and drag set place and heading. */

import { groupAt } from "./layers/groups.js";

const SLOP_PX = 5; // a click may move this far
const DRAG_PX = 14; // a shorter drag sets no heading
const LONG_PRESS_MS = 550;
const WHEEL_STEP = 0.0016;
const LINE_PX = 16;

export class Gestures {
  #pointers = new Map();
  #start = null; // where the first pointer came down
  #moved = false;
  #drawing = false;
  #timer = 0;

  /**
   * @param {HTMLElement} surface
   * @param {View} view
   * @param {Scene} scene
   * @param {object} on onViewed() after each move of the map by hand; onDraft(), onSet(), onPick(id), onGroup(places), onNoDrag(),
   *     onHover(x, y), onLongPress(): boolean
   */
  constructor(surface, view, scene, on) {
    Object.assign(this, { surface, view, scene, on });
    surface.addEventListener("pointerdown", (event) => this.#down(event));
    surface.addEventListener("pointermove", (event) => this.#move(event));
    surface.addEventListener("pointerup", (event) => this.#up(event));
    surface.addEventListener("pointercancel", (event) => this.#cancel(event));
    surface.addEventListener("pointerleave", () => this.on.onHover(null));
    surface.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    surface.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  #at(event) {
    const box = this.surface.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  #down(event) {
    const at = this.#at(event);
    this.surface.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, at);
    clearTimeout(this.#timer);
    if (this.#pointers.size > 1) {
      this.#drop();
      return;
    }
    this.#start = at;
    this.#moved = false;
    const aims = event.button === 0;
    if (aims && this.scene.mode !== "look") this.#begin(at);
    else if (aims) this.#timer = setTimeout(() => this.#press(at), LONG_PRESS_MS);
  }

  #press(at) {
    if (this.#moved || groupAt(this.view, this.scene.hypotheses, ...at) !== null) return;
    if (this.on.onLongPress()) this.#begin(at);
  }

  #begin([px, py]) {
    const [x, y] = this.view.toMap(px, py);
    this.#drawing = true;
    this.scene.draft = { kind: this.scene.mode, x, y, yaw: this.#defaultYaw() };
    this.on.onDraft();
  }

  #defaultYaw() {
    const state = this.scene.state;
    return (state?.pose ?? state?.truth)?.[2] ?? 0;
  }

  #move(event) {
    const at = this.#at(event);
    const before = this.#pointers.get(event.pointerId);
    if (!before) {
      this.#hover(at);
      return;
    }
    if (this.#pointers.size === 2) this.#pinch(event.pointerId, before, at);
    else if (this.#pointers.size === 1) this.#drag(before, at);
    this.#pointers.set(event.pointerId, at);
  }

  #hover(at) {
    const over = groupAt(this.view, this.scene.hypotheses, ...at);
    this.on.onHover(this.view.toMap(...at), over?.first.id ?? null);
  }

  #drag(before, at) {
    const [dx, dy] = [at[0] - this.#start[0], at[1] - this.#start[1]];
    const distance = Math.hypot(dx, dy);
    if (distance > SLOP_PX) {
      if (!this.#moved && !this.#drawing) before = this.#start;
      this.#moved = true;
      clearTimeout(this.#timer);
    }
    if (this.#drawing) this.#pull(at, dx, dy, distance);
    else if (this.#moved) {
      this.view.panBy(at[0] - before[0], at[1] - before[1]);
      this.on.onViewed();
    }
  }

  #pull(at, dx, dy, distance) {
    const draft = this.scene.draft;
    if (!draft) return;
    if (draft.kind === "goal") [draft.x, draft.y] = this.view.toMap(...at);
    else if (distance >= DRAG_PX) draft.yaw = Math.atan2(-dy, dx);
    this.on.onDraft();
  }

  #pinch(id, before, at) {
    const [other] = [...this.#pointers].filter(([key]) => key !== id).map(([, where]) => where);
    const wide = (point) => Math.hypot(point[0] - other[0], point[1] - other[1]);
    this.view.panBy((at[0] - before[0]) / 2, (at[1] - before[1]) / 2);
    const middle = [(at[0] + other[0]) / 2, (at[1] + other[1]) / 2];
    this.view.zoomAt(...middle, wide(at) / Math.max(wide(before), 1));
    this.on.onViewed();
  }

  #up(event) {
    const wasOnly = this.#pointers.size === 1;
    const known = this.#pointers.delete(event.pointerId);
    clearTimeout(this.#timer);
    if (!known || !wasOnly) {
      [this.#start] = this.#pointers.values(); // the finger that stays goes on panning
      this.#moved = true;
      return;
    }
    if (this.#drawing) this.#finish(this.#at(event));
    else if (!this.#moved && event.button === 0) this.#click(this.#at(event));
  }

  #finish(at) {
    const distance = Math.hypot(at[0] - this.#start[0], at[1] - this.#start[1]);
    const needsDrag = this.scene.draft?.kind === "pose";
    this.#drawing = false;
    if (!needsDrag || distance >= DRAG_PX) {
      this.on.onSet();
      return;
    }
    this.#drop();
    if (!this.#pick(at)) this.on.onNoDrag();
  }

  #click(at) {
    this.#pick(at);
  }

  /** Pick the place at a point, or look closer at several; false if there is none. */
  #pick(at) {
    const group = groupAt(this.view, this.scene.hypotheses, ...at);
    if (group?.members.length === 1) this.on.onPick(group.first.id);
    else if (group) this.on.onGroup(group.members);
    return group !== null;
  }

  #drop() {
    this.#drawing = false;
    this.#moved = true;
    this.scene.draft = null;
    this.on.onDraft();
  }

  #cancel(event) {
    this.#pointers.delete(event.pointerId);
    clearTimeout(this.#timer);
    if (this.#drawing) this.#drop();
  }

  #wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PX : 1;
    const faster = event.ctrlKey ? 6 : 1; // a pinch on a touchpad comes as a small wheel with ctrl
    this.view.zoomAt(...this.#at(event), Math.exp(-event.deltaY * lines * faster * WHEEL_STEP));
    this.on.onViewed();
  }
}

/** The last minutes of the robot, and the slider that looks at them again. */

import { stampText } from "./format.js";
import { breakTrail, emptyFrame, leaveTrail } from "./scene.js";

const PERIOD_S = 0.2;
const MOST = 1500; // five minutes; a moment takes some 7 kB
const JUMP_M = 1; // between two moments: not driven

const byId = (id) => document.getElementById(id);

export class Past {
  #moments = []; // {state, scan, heat}, oldest first
  #at = null; // the moment that is looked at; null for live
  #isFresh = false; // the frames that follow belong to the last moment

  /**
   * @param {object} on onLook(frame) when a moment is looked at, onLive() when the robot is looked at again
   */
  constructor(on) {
    this.on = on;
    byId("scrub").addEventListener("input", () => this.#look(Number(byId("scrub").value)));
    for (const id of ["live", "past-live"]) byId(id).addEventListener("click", () => this.goLive());
    // A new event moves the rows: the row that was pressed counts, not the one below at the release.
    let pressed = null;
    byId("events").addEventListener("pointerdown", (event) => {
      pressed = event.target;
    });
    byId("events").addEventListener("click", (event) => {
      const target = pressed ?? event.target;
      pressed = null;
      const item = target.closest("li[data-stamp]");
      if (item && !target.closest("button")) this.lookAt(Number(item.dataset.stamp));
    });
  }

  get isLive() {
    return this.#at === null;
  }

  clear() {
    this.#moments = [];
    this.#isFresh = false;
    this.goLive();
    this.#showSlider();
  }

  /** Keep a state, unless the last one has just been kept. */
  record(state, { scan, heat }) {
    const last = this.#moments.at(-1)?.state;
    if (last && state.stamp < last.stamp) this.clear(); // another clock
    this.#isFresh = !last || state.stamp - last.stamp >= PERIOD_S || state.state !== last.state;
    if (!this.#isFresh) return;
    this.#moments.push({ state, scan, heat });
    if (this.#moments.length > MOST) this.#moments.shift();
    this.#showSlider();
  }

  /** Keep what was sent with the last state. */
  attach(frame) {
    const last = this.#moments.at(-1);
    if (!this.#isFresh) return;
    if (frame.kind === "scan") last.scan = frame;
    else if (frame.kind === "belief") last.heat = frame.heat;
  }

  /** Look at the moment of a stamp; at the newest one if it is not yet kept. */
  lookAt(stamp) {
    const next = this.#moments.findIndex(({ state }) => state.stamp >= stamp);
    const moment = this.#moments.at(next); // -1 if none: the newest
    if (moment) this.#stopAt(moment);
  }

  /** Look at the moment before, or after. */
  step(by) {
    const now = this.isLive ? this.#moments.length - 1 : this.#moments.indexOf(this.#at);
    this.#look(Math.max(now + by, 0));
  }

  goLive() {
    if (this.isLive) return;
    this.#at = null;
    this.#showSlider();
    this.on.onLive();
  }

  #look(index) {
    if (index >= this.#moments.length - 1) {
      this.goLive();
      return;
    }
    this.#stopAt(this.#moments[index]);
  }

  #stopAt(moment) {
    this.#at = moment;
    this.#showSlider();
    this.on.onLook({ ...emptyFrame(), ...moment, trail: this.#trail(moment) });
  }

  #trail(end) {
    const trail = [];
    for (const { state } of this.#moments.slice(0, this.#moments.indexOf(end) + 1)) {
      if (state.pose) leaveTrail(trail, state.pose, JUMP_M);
      else breakTrail(trail);
    }
    return trail;
  }

  #showSlider() {
    const newest = this.#moments.length - 1;
    // What is looked at may have become too old to be kept.
    const index = this.isLive ? newest : Math.max(this.#moments.indexOf(this.#at), 0);
    const slider = byId("scrub");
    slider.max = String(Math.max(newest, 0));
    slider.value = String(Math.max(index, 0));
    slider.disabled = newest < 1;
    const text = this.isLive ? "live" : stampText(this.#at.state.stamp);
    slider.setAttribute("aria-valuetext", text);
    byId("scrub-text").textContent = text;
    byId("live").hidden = this.isLive;
    byId("past").hidden = this.isLive;
    byId("past-text").textContent = `Looking back at ${text}.`;
  }
}

/** The guided tour of a simulated robot: found, kidnapped, look-alike rooms. */

import { length, seconds } from "./format.js";
import { keep, recall } from "./storage.js";

const KEY = "firstfix-tour";
const AWAY_M = 0.5; // so far from the true pose, a pose is wrong
const ALIKE = "hotel"; // a world whose rooms look alike until the robot drives
const DISTINCT = "office"; // a world where one scan is enough
const INVITATION = {
  title: "Three things in one minute",
  text: "The robot is found from one scan, kidnapped, and set among rooms that look alike.",
};

const byId = (id) => document.getElementById(id);

/** Each step acts once, and then says in a sentence or two what is seen. */
const STEPS = [
  {
    title: "Found from one scan",
    act(tour) {
      const here = tour.world;
      tour.enter(["rooms", "corridor", ALIKE].includes(here) ? DISTINCT : here);
    },
    text(state, seen) {
      if (!seen.entered || state.state === "SEARCHING") {
        return "The robot wakes up at an unknown place. Its first scan is compared with the whole map.";
      }
      if (state.state !== "LOCALIZED") return "Several places fit this scan, so no pose is published yet.";
      seen.done ||= `Found before it moved, ${length(error(state))} from the true pose (dashed outline).`;
      return seen.done;
    },
  },
  {
    title: "Kidnapped without a signal",
    act(tour) {
      tour.send({ type: "amcl", start: "pose" });
      tour.send({ type: "kidnap" });
    },
    text(state, seen) {
      seen.from ??= state.stamp;
      const isRight = state.state === "LOCALIZED" && error(state) < AWAY_M;
      seen.wasWrong ||= !isRight;
      if (seen.done) return seen.done;
      if (state.state !== "LOCALIZED" && seen.wasWrong) {
        return "The old pose does not explain the scans, so it is withdrawn. The whole map is searched.";
      }
      if (!seen.wasWrong || !isRight) {
        return "It was teleported. No sensor reports it, and the wheels claim that it stands still.";
      }
      const off = error({ pose: state.amcl?.pose, truth: state.truth });
      const plain = off < Infinity ? ` Plain AMCL (the square) is ${length(off)} off.` : "";
      seen.done = `Noticed and found again ${seconds(state.stamp - seen.from)} later, without help.${plain}`;
      return seen.done;
    },
  },
  {
    title: "Rooms that look alike",
    act(tour) {
      tour.send({ type: "amcl", start: "off" });
      tour.enter(ALIKE);
    },
    text(state, seen, tour) {
      const isOpen = state.state === "DISAMBIGUATING";
      tour.offerToDecide(seen.entered && isOpen && Boolean(state.motion) && !seen.decides);
      if (!seen.entered || state.state === "SEARCHING") return "A hotel: from inside, every room looks the same.";
      if (isOpen && seen.decides) return "It drives to where the rooms differ. Watch the numbered places vanish.";
      if (isOpen) return `${state.rivals} rooms fit equally well, so no pose is published. It does not guess.`;
      return "The corridor looks different in front of each room. One place is left, and only now it is published.";
    },
  },
];

export class Tour {
  #step = -1; // -1: the invitation
  #seen = {}; // what was observed in this step
  #state = null;
  #shown = "";

  /** @param {(message: object) => boolean} send sends a command */
  constructor(send) {
    this.send = send;
    byId("tour-button").addEventListener("click", () => this.toggle());
    byId("tour-next").addEventListener("click", () => this.#next());
    byId("tour-leave").addEventListener("click", () => this.leave());
    byId("tour-decide").addEventListener("click", () => this.#decide());
  }

  get isOpen() {
    return !byId("tour").hidden;
  }

  /** The world that the robot is in. */
  get world() {
    return this.#state?.simulation?.world ?? DISTINCT;
  }

  /** Offer the tour to those who may steer a simulated robot, from `hello`. */
  greet({ robot, may_steer: maySteer, map }) {
    const isOffered = robot === "sim" && maySteer;
    byId("tour-button").hidden = !isOffered;
    if (!isOffered) this.leave();
    else if (map && map.name === this.#seen.world) this.#seen.entered = true;
    else if (!this.isOpen && recall("localStorage", KEY) === null) this.#open(-1);
  }

  /** Say what a state of the robot means for the step. */
  show(state) {
    this.#state = state;
    if (this.#step >= 0 && this.isOpen) this.#write(STEPS[this.#step].text(state, this.#seen, this));
  }

  toggle() {
    if (this.isOpen) this.leave();
    else if (!byId("tour-button").hidden) {
      this.#open(-1);
      byId("tour-next").focus();
    }
  }

  leave() {
    if (!this.isOpen) return;
    byId("tour").hidden = true;
    this.#step = -1;
    this.#seen = {};
    keep("localStorage", KEY, "seen");
  }

  /** Restart the simulation in a world. */
  enter(world) {
    this.#seen.world = world;
    this.send({ type: "world", name: world });
  }

  offerToDecide(isOffered) {
    byId("tour-decide").hidden = !isOffered;
    byId("tour-next").classList.toggle("primary", !isOffered);
  }

  #next() {
    if (this.#step + 1 === STEPS.length) {
      this.leave();
      return;
    }
    this.#open(this.#step + 1);
    const { paused, simulation } = this.#state ?? {};
    if (paused) this.send({ type: "pause", paused: false });
    if (simulation?.covered) this.send({ type: "cover", covered: false });
    STEPS[this.#step].act(this);
    if (this.#state) this.show(this.#state);
  }

  #open(step) {
    this.#step = step;
    this.#seen = {};
    this.offerToDecide(false);
    byId("tour").hidden = false;
    byId("tour-count").textContent = step < 0 ? "Tour" : `Step ${step + 1} of ${STEPS.length}`;
    byId("tour-title").textContent = (STEPS[step] ?? INVITATION).title;
    byId("tour-leave").textContent = step < 0 ? "Not now" : "Leave";
    const last = step + 1 === STEPS.length;
    byId("tour-next").textContent = step < 0 ? "Start" : last ? "Finish" : "Next";
    this.#write(step < 0 ? INVITATION.text : "");
  }

  #decide() {
    this.#seen.decides = true;
    this.offerToDecide(false);
    this.send({ type: "decide" });
    byId("tour-next").focus();
  }

  #write(text) {
    if (text === this.#shown) return;
    this.#shown = text;
    byId("tour-text").textContent = text;
  }
}

/** How far a pose is from the true one, m. */
function error({ pose, truth }) {
  return pose && truth ? Math.hypot(pose[0] - truth[0], pose[1] - truth[1]) : Infinity;
}

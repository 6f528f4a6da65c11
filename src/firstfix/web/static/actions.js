/** The commands, and the mode that decides what a press on the map does. */

import { Simulation } from "./simulation.js";

const MODES = {
  pose: {
    text: "Press where the robot stands, then drag in the direction it faces.",
    keys: "Arrows move, Shift + ← → turn, Enter sets.",
  },
  goal: { text: "Click where the robot should drive.", keys: "Arrows move, Enter sends." },
  carry: {
    text: "Press where the robot is set down, then drag in the direction it faces.",
    keys: "Arrows move, Shift + ← → turn, Enter sets down.",
  },
};

const byId = (id) => document.getElementById(id);

export class Actions {
  #abilities = new Set();
  #maySteer = false;
  #asked = null; // {kind, place}: the last command that was given on the map

  /**
   * @param {Connection} connection
   * @param {Scene} scene
   * @param {View} view
   * @param {Notices} notices
   * @param {() => void} onChange the map must be redrawn
   * @param {() => void} onSend a command is about to be sent
   */
  constructor(connection, scene, view, notices, onChange, onSend) {
    Object.assign(this, { connection, scene, view, notices, onChange, onSend });
    for (const mode of Object.keys(MODES)) {
      byId(`mode-${mode}`).addEventListener("click", () => this.toggleMode(mode));
    }
    byId("leave-mode").addEventListener("click", () => this.leaveMode());
    byId("relocalize").addEventListener("click", () => this.relocalize());
    byId("pause").addEventListener("click", () => this.togglePause());
    byId("kidnap").addEventListener("click", () => this.kidnap());
    byId("decide").addEventListener("click", () => this.send({ type: "decide" }));
    this.simulation = new Simulation((message) => this.send(message));
  }

  /** Show what this viewer may do, from `hello`. */
  allow({ may_steer: maySteer, abilities, menus }) {
    this.#maySteer = maySteer;
    this.#abilities = new Set(maySteer ? ["pose", ...abilities] : []);
    byId("tools").hidden = !maySteer;
    byId("watching").hidden = maySteer;
    byId("places-hint").hidden = !maySteer;
    byId("mode-goal").hidden = !this.#abilities.has("goal");
    byId("mode-carry").hidden = !this.#abilities.has("carry");
    byId("pause").hidden = !this.#abilities.has("pause");
    byId("kidnap").hidden = !this.#abilities.has("kidnap");
    this.simulation.offer(maySteer ? menus : null);
    for (const line of document.querySelectorAll("#help-dialog .steer")) {
      const asks = ["goal", "carry", "kidnap", "pause"].filter((ability) => line.classList.contains(ability));
      line.hidden = !maySteer || !asks.every((ability) => this.#abilities.has(ability));
    }
    if (!this.#abilities.has(this.scene.mode)) this.leaveMode();
  }

  get maySteer() {
    return this.#maySteer;
  }

  toggleMode(mode) {
    if (this.scene.mode === mode) this.leaveMode();
    else if (this.#abilities.has(mode)) this.#enter(mode);
  }

  /** With keys, the draft starts somewhere before it is moved. */
  toggleModeByKey(mode) {
    this.toggleMode(mode);
    if (this.scene.mode === mode) this.#beginDraft();
  }

  /** By a long press; false on a read-only server. */
  enterPoseMode() {
    if (this.#maySteer && this.scene.mode !== "pose") this.#enter("pose");
    return this.#maySteer;
  }

  leaveMode() {
    this.#enter("look");
  }

  #beginDraft() {
    const { scene, view } = this;
    const [x, y] = view.toMap(...view.middle);
    const pose = scene.state?.pose;
    const [atX, atY, yaw] = scene.mode === "carry" ? [x, y, 0] : (pose ?? [x, y, 0]);
    scene.draft = { kind: scene.mode, x: atX, y: atY, yaw };
    this.onChange();
  }

  #enter(mode) {
    const { scene } = this;
    scene.mode = mode;
    scene.draft = null;
    byId("app").dataset.mode = mode;
    for (const name of Object.keys(MODES)) {
      byId(`mode-${name}`).setAttribute("aria-pressed", String(name === mode));
    }
    this.notices.showMode(MODES[mode] ?? null);
    this.onChange();
  }

  /** Send the draft. */
  set() {
    const { scene } = this;
    const draft = scene.draft;
    scene.draft = null;
    if (!draft) return;
    const { kind, x, y, yaw } = draft;
    const wrapped = Math.atan2(Math.sin(yaw), Math.cos(yaw));
    this.#asked = { kind, place: [x, y] };
    if (kind === "goal") {
      if (this.send({ type: "goal", x, y })) scene.wish = [x, y];
    } else {
      scene.wish = null;
      this.send({ type: kind, x, y, yaw: wrapped });
      this.leaveMode();
    }
    this.onChange();
  }

  /** A command of this viewer was refused: say so where it was given. */
  refuse({ detail, command }) {
    if (command === "goal") this.scene.wish = null;
    this.#answer(detail, command);
    this.onChange();
  }

  /** The localizer judged a proposed pose, and did not accept it. */
  rejectPose(text) {
    if (this.#asked?.kind === "pose") this.#answer(text, "pose");
  }

  #answer(text, command) {
    if (this.#asked?.kind === command) this.notices.showAnswer(text, this.#asked.place);
    else this.notices.showError(text);
    this.#asked = null;
  }

  pick(id) {
    if (!this.#maySteer) return;
    this.send({ type: "pick", id });
    this.leaveMode();
  }

  relocalize() {
    if (this.#maySteer) this.send({ type: "relocalize" });
  }

  togglePause() {
    if (!this.#abilities.has("pause")) return;
    this.send({ type: "pause", paused: !this.scene.live.state?.paused });
  }

  kidnap() {
    if (!this.#abilities.has("kidnap")) return;
    this.scene.wish = null;
    this.send({ type: "kidnap" });
  }

  /** Whether the deciding motion of the state can be executed by a button. */
  get canDecide() {
    return this.#abilities.has("decide");
  }

  needsDrag() {
    this.notices.showError("Press where the robot stands, then drag in the direction it faces.");
  }

  /** Send a command; false if there is no connection, which is said. */
  send(message) {
    this.onSend();
    const sent = this.connection.send(message);
    if (!sent) this.notices.showError("Not connected. Nothing was sent.");
    return sent;
  }
}

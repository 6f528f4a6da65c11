/** Everything that the layers draw. */

const TRAIL_STEP_M = 0.04;
const TRAIL_POINTS = 3000;
const JUMP_M = 0.6; // between two poses 50 ms apart: not driven, so the trail is broken

export class Scene {
  constructor() {
    this.map = null; // as GET /v1/map
    this.image = null; // ImageBitmap of the map
    this.clearRobot();
    this.mode = "look";
    this.draft = null; // {kind, x, y, yaw}: the command that is being drawn
    this.goal = null; // [x, y] where the robot was last sent
    this.highlighted = null; // id of the hypothesis under the pointer or the focus
    this.shown = { belief: true, scan: true, particles: true, trail: true, truth: true };
  }

  clearRobot() {
    this.state = null;
    this.scan = null;
    this.particles = null;
    this.heat = null;
    this.trail = [];
    this.goal = null;
    this.highlighted = null;
  }

  /** The places of which a person may choose one; empty once the robot is localized. */
  get hypotheses() {
    if (!this.state || this.state.state === "LOCALIZED") return [];
    return this.state.hypotheses;
  }

  takeState(state) {
    this.state = state;
    if (state.pose) this.#leaveTrail(state.pose);
    else this.#breakTrail();
    if (!state.pose && !this.hypotheses.length) this.scan = null;
    if (!state.pose) this.particles = null;
    this.#arrive(state);
  }

  takeFrame(frame) {
    if (frame.kind === "scan") this.scan = frame;
    else if (frame.kind === "belief") this.heat = frame.heat;
    else this.particles = frame;
  }

  #leaveTrail([x, y]) {
    const last = this.trail.at(-1);
    if (last) {
      const step = Math.hypot(x - last[0], y - last[1]);
      if (step < TRAIL_STEP_M) return;
      if (step > JUMP_M) this.trail.push(null);
    }
    this.trail.push([x, y]);
    if (this.trail.length > TRAIL_POINTS) this.trail.splice(0, TRAIL_POINTS / 10);
  }

  #breakTrail() {
    if (this.trail.at(-1)) this.trail.push(null);
  }

  #arrive(state) {
    if (!this.goal) return;
    const at = state.pose;
    if (!at || Math.hypot(at[0] - this.goal[0], at[1] - this.goal[1]) < 0.25) this.goal = null;
  }
}

/** What is known about the robot just now: everything that the layers draw. */

const TRAIL_STEP_M = 0.04;
const TRAIL_POINTS = 3000;
const JUMP_M = 0.6; // between two poses 50 ms apart: not driven

export class Scene {
  constructor() {
    this.map = null; // as GET /v1/map says
    this.image = null; // ImageBitmap of the map
    this.forgetRobot();
    this.mode = "look";
    this.draft = null; // {kind, x, y, yaw}: what a person is about to say
    this.goal = null; // [x, y] where the robot was last sent
    this.marked = null; // id of the ghost under the pointer or the focus
    this.shown = { scan: true, particles: true, trail: true, truth: true };
  }

  forgetRobot() {
    this.state = null;
    this.scan = null;
    this.particles = null;
    this.trail = [];
    this.goal = null;
    this.marked = null;
  }

  /** Several places, of which a person may choose one; none once the robot is found. */
  get ghosts() {
    if (!this.state || this.state.state === "LOCALIZED") return [];
    return this.state.hypotheses;
  }

  takeState(state) {
    this.state = state;
    if (state.pose) this.#leaveTrail(state.pose);
    else this.#breakTrail();
    if (!state.pose && !this.ghosts.length) this.scan = null;
    if (!state.pose) this.particles = null;
    this.#arrive(state);
  }

  takeFrame(frame) {
    if (frame.kind === "scan") this.scan = frame;
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

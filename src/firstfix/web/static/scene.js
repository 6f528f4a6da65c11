/** Everything that the layers draw: the robot as it is now, or another frame that a person looks at. */

const TRAIL_STEP_M = 0.04;
const TRAIL_POINTS = 3000;
const JUMP_M = 0.6; // between two poses 50 ms apart: not driven, so the trail is broken

/** What is known at one moment; map and image are null where they are those of the robot. */
export function emptyFrame() {
  return { state: null, scan: null, particles: null, heat: null, trail: [], map: null, image: null };
}

export class Scene {
  constructor() {
    this.live = emptyFrame(); // its map is as GET /v1/map, its image an ImageBitmap
    this.frame = this.live;
    this.changes = null; // the layer of what has changed in the map
    this.mode = "look";
    this.draft = null; // {kind, x, y, yaw}: the command that is being drawn
    this.wish = null; // [x, y] where the robot was sent, until a path is known
    this.highlighted = null; // id of the hypothesis under the pointer or the focus
    this.shown = { belief: true, scan: true, particles: true, trail: true, truth: true, changes: true };
  }

  get isLive() {
    return this.frame === this.live;
  }

  get map() {
    return this.frame.map ?? this.live.map;
  }

  get image() {
    return this.frame.map ? this.frame.image : this.live.image;
  }

  get state() {
    return this.frame.state;
  }

  get scan() {
    return this.frame.scan;
  }

  get particles() {
    return this.frame.particles;
  }

  get heat() {
    return this.frame.heat;
  }

  get trail() {
    return this.frame.trail;
  }

  clearRobot() {
    const { map, image } = this.live;
    Object.assign(this.live, emptyFrame(), { map, image });
    this.wish = null;
    this.highlighted = null;
  }

  /** The path of a simulated robot to its goal, [x, y] of each corner; empty if there is none. */
  get path() {
    return this.state?.simulation?.path ?? [];
  }

  /** The goal of the robot, [x, y], or null. */
  get goal() {
    return this.path.at(-1) ?? (this.isLive ? this.wish : null);
  }

  /** The places of which a person may choose one; empty once the robot is localized. */
  get hypotheses() {
    if (!this.state || this.state.state === "LOCALIZED") return [];
    return this.state.hypotheses;
  }

  takeState(state) {
    const { live } = this;
    live.state = state;
    if (state.pose) leaveTrail(live.trail, state.pose);
    else breakTrail(live.trail);
    const isOpen = state.state !== "LOCALIZED" && state.hypotheses.length > 0;
    if (!state.pose && !isOpen) live.scan = null;
    if (!state.pose) live.particles = null;
    if (state.simulation?.path.length) this.wish = null;
  }

  takeFrame(frame) {
    if (frame.kind === "scan") this.live.scan = frame;
    else if (frame.kind === "belief") this.live.heat = frame.heat;
    else this.live.particles = frame;
  }
}

/** Add a pose to a trail, unless it is where the trail ends. */
export function leaveTrail(trail, [x, y], jump = JUMP_M) {
  const last = trail.at(-1);
  if (last) {
    const step = Math.hypot(x - last[0], y - last[1]);
    if (step < TRAIL_STEP_M) return;
    if (step > jump) trail.push(null);
  }
  trail.push([x, y]);
  if (trail.length > TRAIL_POINTS) trail.splice(0, TRAIL_POINTS / 10);
}

export function breakTrail(trail) {
  if (trail.at(-1)) trail.push(null);
}

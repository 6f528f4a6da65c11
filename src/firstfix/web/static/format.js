/** Texts for states and numbers. The names of states are those of the API. */

const STATES = {
  CONNECTING: { icon: "i-offline", verdict: "Waiting for the robot." },
  NO_MAP: { icon: "i-nomap", verdict: "No map has been received." },
  SEARCHING: { icon: "i-search", verdict: "The pose is unknown." },
  VERIFYING_HINT: { icon: "i-search", verdict: "The next scan verifies the proposed pose." },
  DISAMBIGUATING: { icon: "i-ambiguous", verdict: "Several places fit." },
  LIFTED: { icon: "i-carry", verdict: "The robot was picked up. Waiting until it is set down." },
  LOCALIZED: { icon: "i-localized", verdict: "One place fits." },
};

/** The icon of a state, and one sentence about it. */
export function stateTexts(name) {
  return STATES[name] ?? { icon: "i-help", verdict: "" };
}

/** The same for a pose that somebody chose among equal places, until evidence decides. */
export function choiceTexts({ chosen_by: source, rivals }) {
  const by = source.charAt(0).toUpperCase() + source.slice(1);
  const why = rivals > 1 ? `${rivals} places fit equally well.` : "The scans do not decide yet.";
  return { icon: "i-pose", verdict: `${by} chose this place. ${why}` };
}

export function degrees(radians) {
  return (radians * 180) / Math.PI;
}

export function percent(share) {
  if (share > 0 && share < 0.005) return "<1%";
  return `${Math.round(100 * share)}%`;
}

/** Places that are still possible, and the probability that the robot is elsewhere. */
export function beliefText(belief) {
  if (!belief) return "–";
  const places = belief.places === 1 ? "1 place" : `${belief.places} places`;
  return `${places} · elsewhere ${percent(belief.elsewhere)}`;
}

/** A pose: metres, and the heading from 0° to 359°, counter-clockwise from +x. */
export function poseText([x, y, yaw]) {
  return `${metres(x)}, ${metres(y)} m · ${heading(yaw)}`;
}

export function heading(yaw) {
  const whole = Math.round(degrees(yaw));
  return `${((whole % 360) + 360) % 360}°`;
}

export function metres(value) {
  const text = value.toFixed(2);
  return (text === "-0.00" ? "0.00" : text).replace("-", "−");
}

/** A length: centimetres below one metre. */
export function length(value) {
  return value < 1 ? `${(100 * value).toFixed(1)} cm` : `${value.toFixed(2)} m`;
}

export function seconds(value) {
  return value < 10 ? `${value.toFixed(2)} s` : `${value.toFixed(0)} s`;
}

/** The motion that would decide between the hypotheses. */
export function motionText({ turn, ahead }) {
  const parts = [];
  const angle = Math.round(Math.abs(degrees(turn)));
  if (angle > 0) parts.push(`turn ${angle}° to the ${turn > 0 ? "left" : "right"}`);
  if (ahead > 0) parts.push(`drive ${ahead.toFixed(1)} m ahead`);
  return parts.length ? `To decide: ${parts.join(", then ")}.` : "";
}

const EPOCH = 1e8; // s; later stamps are dates, earlier ones count from the start of the simulation

export function stampText(stamp) {
  if (stamp > EPOCH) return new Date(1000 * stamp).toLocaleTimeString([], { hour12: false });
  const whole = Math.max(Math.floor(stamp), 0);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

/** Numbers and states in words. */

const STATES = {
  CONNECTING: { word: "CONNECTING", icon: "i-offline", verdict: "Waiting for the robot." },
  NO_MAP: { word: "NO MAP", icon: "i-nomap", verdict: "There is no map to be found in." },
  SEARCHING: { word: "SEARCHING", icon: "i-search", verdict: "No place is known yet." },
  VERIFYING_HINT: { word: "VERIFYING HINT", icon: "i-search", verdict: "The next scan judges the hint." },
  DISAMBIGUATING: { word: "DISAMBIGUATING", icon: "i-ambiguous", verdict: "Several places fit." },
  LIFTED: { word: "LIFTED", icon: "i-search", verdict: "The robot is in the air." },
  LOCALIZED: { word: "LOCALIZED", icon: "i-localized", verdict: "One place fits." },
};

export function wordsOfState(name) {
  return STATES[name] ?? { word: name, icon: "i-help", verdict: "" };
}

export function degrees(radians) {
  return (radians * 180) / Math.PI;
}

export function percent(share) {
  if (share > 0 && share < 0.005) return "<1%";
  return `${Math.round(100 * share)}%`;
}

/** A pose as people say it: metres, and the heading from 0° to 359°, counter-clockwise from +x. */
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

/** A length that may be small: centimetres below one metre. */
export function length(value) {
  return value < 1 ? `${(100 * value).toFixed(1)} cm` : `${value.toFixed(2)} m`;
}

export function seconds(value) {
  return value < 10 ? `${value.toFixed(2)} s` : `${value.toFixed(0)} s`;
}

/** How a robot has to move so that the places look different. */
export function motionText({ turn, ahead }) {
  const parts = [];
  const angle = Math.round(Math.abs(degrees(turn)));
  if (angle > 0) parts.push(`turn ${angle}° to the ${turn > 0 ? "left" : "right"}`);
  if (ahead > 0) parts.push(`drive ${ahead.toFixed(1)} m ahead`);
  return parts.length ? `To decide: ${parts.join(", then ")}.` : "";
}

const EPOCH = 1e8; // s; later stamps are dates, earlier ones count from the start of a simulation

export function stampText(stamp) {
  if (stamp > EPOCH) return new Date(1000 * stamp).toLocaleTimeString([], { hour12: false });
  const whole = Math.max(Math.floor(stamp), 0);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

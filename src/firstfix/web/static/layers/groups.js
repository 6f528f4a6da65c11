/** Hypotheses whose symbols would overlap are one symbol with a count. */

import { robotRadius } from "./robot.js";

const LEAST_TARGET_PX = 24; // a finger must be able to hit it
const OVERLAP = 2.2; // of the radius of a symbol: below, symbols or their labels overlap

/**
 * Group hypotheses by what overlaps in the window; the first of each group is its most likely one.
 *
 * @returns {{first: object, index: number, members: object[], probability: number}[]} most likely first
 */
export function groupsOf(view, hypotheses) {
  const reach = OVERLAP * Math.max(robotRadius(view), 11);
  const groups = [];
  hypotheses.forEach((hypothesis, index) => {
    const [x, y] = hypothesis.pose;
    const near = groups.find(({ first: { pose } }) => Math.hypot(pose[0] - x, pose[1] - y) * view.scale < reach);
    if (near) {
      near.members.push(hypothesis);
      near.probability += hypothesis.probability;
    } else {
      groups.push({ first: hypothesis, index, members: [hypothesis], probability: hypothesis.probability });
    }
  });
  return groups;
}

/** The group at a point of the window, or null. */
export function groupAt(view, hypotheses, px, py) {
  let [best, nearest] = [null, Math.max(robotRadius(view), LEAST_TARGET_PX)];
  for (const group of groupsOf(view, hypotheses)) {
    const [x, y] = view.toScreen(group.first.pose[0], group.first.pose[1]);
    const distance = Math.hypot(px - x, py - y);
    if (distance < nearest) [best, nearest] = [group, distance];
  }
  return best;
}

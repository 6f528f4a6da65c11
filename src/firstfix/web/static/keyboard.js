/** Everything that the mouse does, with keys. */

const PAN_PX = 70;
const NUDGE_PX = 8;
const TURN = Math.PI / 36;
const ZOOM = 1.3;
const MAY_REPEAT = new Set([",", "."]);
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/**
 * Listen to the keys of the whole page.
 *
 * @param {object} page view, scene, actions, follow and theme; onViewed() and onDraft() as in Gestures
 */
export function listenToKeys(page) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (belongsToControl(event)) return;
    if (pressed(page, event)) event.preventDefault();
  });
}

/** Keys that a focused control uses itself. */
function belongsToControl({ key, target }) {
  if (target.matches("input[type=text], input[type=password]")) return true;
  if (target.matches("input[type=range], select")) return key in ARROWS;
  if (target.matches("#details, #events")) return key === "ArrowUp" || key === "ArrowDown";
  return target.matches("button, a") && (key === " " || key === "Enter");
}

function pressed({ view, scene, actions, commands, onViewed, onDraft }, event) {
  const { key } = event;
  if (key in ARROWS) {
    if (scene.draft) moveDraft(view, scene.draft, ARROWS[key], event.shiftKey, onDraft);
    else {
      view.panBy(-ARROWS[key][0] * PAN_PX, ARROWS[key][1] * PAN_PX);
      onViewed();
    }
    return true;
  }
  const zoom = { "+": ZOOM, "=": ZOOM, "-": 1 / ZOOM, _: 1 / ZOOM }[key];
  if (zoom) {
    view.zoomBy(zoom);
    onViewed();
    return true;
  }
  if (key === "Enter" && scene.draft) {
    actions.set();
    return true;
  }
  const command = commands[key === " " ? "Space" : key.toLowerCase()];
  if (!command || (event.repeat && !MAY_REPEAT.has(key))) return false;
  command();
  return true;
}

function moveDraft(view, draft, [right, up], turns, onDraft) {
  if (turns) draft.yaw -= right * TURN;
  else {
    draft.x += (right * NUDGE_PX) / view.scale;
    draft.y += (up * NUDGE_PX) / view.scale;
  }
  onDraft();
}

/** The panel: state, reason, evidence, hypotheses and figures. */

import * as format from "./format.js";

const EVERY_MS = 250; // figures that change faster cannot be read
const STALE_AFTER_MS = 3000;
const KINDS = ["explained", "short", "through_wall", "unknown"];

const byId = (id) => document.getElementById(id);

function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export class Panel {
  #shownName = "";
  #state = null;
  #timer = 0;
  #receivedAt = 0;
  isLive = true; // false while a person looks at another moment

  /**
   * @param {object} on onPick(id), onHighlight(id), onNewState(text for a screen reader)
   */
  constructor(on) {
    this.on = on;
    setInterval(() => this.#showAge(), 1000);
  }

  showMap(map) {
    const size = `${map.width} × ${map.height} cells of ${+(100 * map.resolution).toFixed(2)} cm`;
    setText(byId("map-name"), map.name);
    byId("map-name").title = `${map.name}: ${size}`;
    document.title = `firstfix · ${map.name}`;
  }

  /** Show a state: at once if it changed, else with the next update. */
  show(state) {
    this.#state = state;
    this.#receivedAt = performance.now();
    if (nameOf(state) !== this.#shownName) this.#render();
    else this.#timer ||= setTimeout(() => this.#render(), EVERY_MS);
  }

  #render() {
    clearTimeout(this.#timer);
    this.#timer = 0;
    const state = this.#state;
    this.#showState(state);
    this.#showPlaces(state);
    this.#showEvidence(state.evidence);
    this.#showFigures(state);
    this.#showAge();
  }

  #showState(state) {
    const name = state.state;
    const { icon, verdict } = state.chosen_by ? format.choiceTexts(state) : format.stateTexts(name);
    byId("app").dataset.state = name;
    byId("app").dataset.chosen = String(Boolean(state.chosen_by));
    setText(byId("state-word"), state.word ?? name);
    byId("state-icon").setAttribute("href", `#${icon}`);
    setText(byId("verdict"), verdict);
    setText(byId("reason"), sentence(state.reason));
    byId("reason").hidden = Boolean(state.chosen_by); // the verdict says it
    const places = state.rivals > 1 ? `${state.rivals} places` : "";
    setText(byId("state-note"), places);
    byId("state-note").hidden = !places;
    byId("paused").hidden = !state.paused;
    const advice = state.motion && name === "DISAMBIGUATING" ? format.motionText(state.motion) : "";
    setText(byId("advice-text"), advice);
    byId("advice").hidden = !advice;
    if (nameOf(state) === this.#shownName) return;
    this.#shownName = nameOf(state);
    const spoken = name.toLowerCase().replaceAll("_", " ");
    this.on.onNewState(`${spoken}. ${verdict} ${sentence(state.reason)}`);
  }

  #showPlaces(state) {
    const places = state.state === "LOCALIZED" ? [] : state.hypotheses;
    byId("places").hidden = places.length === 0;
    setText(byId("places-count"), state.belief ? format.beliefText(state.belief) : "");
    const list = byId("places-list");
    while (list.children.length > places.length) list.lastElementChild.remove();
    while (list.children.length < places.length) list.append(this.#newPlace());
    places.forEach((place, i) => {
      const button = list.children[i].firstElementChild;
      button.dataset.id = place.id;
      const [number, chance, where] = button.children;
      setText(number, String(i + 1));
      setText(chance, format.percent(place.probability));
      const fits = place.explained == null ? "" : `${format.percent(place.explained)} of the beams fit`;
      setText(where.firstElementChild, format.poseText(place.pose));
      setText(where.lastElementChild, fits);
    });
  }

  /** Move the focus to a place in the list. */
  focusPlace(id) {
    byId("places-list").querySelector(`[data-id="${id}"]`)?.focus();
  }

  #newPlace() {
    const item = document.createElement("li");
    const button = document.createElement("button");
    button.type = "button";
    button.className = "place";
    const where = child("span", "where");
    where.append(child("span", ""), child("small", ""));
    button.append(child("span", "number"), child("b", ""), where);
    // The id of the place that is shown, also if the list has changed since.
    const id = () => Number(button.dataset.id);
    button.addEventListener("click", () => this.on.onPick(id()));
    for (const event of ["focus", "pointerenter"]) {
      button.addEventListener(event, () => this.on.onHighlight(id()));
    }
    for (const event of ["blur", "pointerleave"]) {
      button.addEventListener(event, () => this.on.onHighlight(null));
    }
    item.append(button);
    return item;
  }

  #showEvidence(evidence) {
    setText(byId("beams"), evidence ? `${evidence.beams} beams` : "");
    const parts = [];
    for (const kind of KINDS) {
      const css = kind.replace("_", "-");
      const share = evidence ? evidence[kind] : 0;
      const text = evidence ? format.percent(share) : "–";
      const part = byId("evidence-bar").querySelector(`.${css}`);
      part.style.flexGrow = share;
      part.hidden = share === 0;
      const row = byId("legend").querySelector(`.${css}`);
      setText(row.querySelector("b"), text);
      parts.push(`${text} ${row.querySelector("span").textContent}`);
    }
    const label = evidence ? parts.join(", ") : "No scan yet";
    byId("evidence-bar").setAttribute("aria-label", label);
  }

  #showFigures(state) {
    const { pose, truth, covariance } = state;
    setText(byId("pose"), pose ? format.poseText(pose) : "–");
    setText(byId("spread"), pose && covariance ? spreadText(covariance) : "–");
    byId("error-row").hidden = !truth;
    setText(byId("error"), pose && truth ? errorText(pose, truth) : "–");
    byId("amcl-row").hidden = (state.simulation?.amcl ?? "off") === "off";
    setText(byId("amcl-error"), state.amcl && truth ? errorText(state.amcl.pose, truth) : "no pose yet");
    setText(byId("belief"), format.beliefText(state.belief));
    const fix = state.time_to_fix_s;
    setText(byId("time-to-fix"), fix == null ? "–" : format.seconds(fix));
    setText(byId("cpu"), state.cpu_ms == null ? "–" : `${state.cpu_ms.toFixed(1)} ms`);
    setText(byId("particles"), state.particles ? state.particles.toLocaleString("en") : "–");
    setText(byId("viewers"), state.viewers === null ? "–" : String(state.viewers ?? 1));
  }

  #showAge() {
    const age = performance.now() - this.#receivedAt;
    const isStale = this.#state && this.isLive && !this.#state.paused && age > STALE_AFTER_MS;
    byId("stale").hidden = !isStale;
    if (isStale) setText(byId("stale"), `Nothing received for ${Math.floor(age / 1000)} s.`);
  }
}

/** A new name makes the panel render at once. */
function nameOf(state) {
  return `${state.word ?? state.state} ${state.chosen_by ?? ""}`;
}

function child(tag, className) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  return element;
}

function sentence(text) {
  if (!text) return "";
  const plain = text.replaceAll("_", " "); // such as wheel_drop
  const first = plain.charAt(0).toUpperCase() + plain.slice(1);
  return /[.!?]$/.test(first) ? first : `${first}.`;
}

function spreadText([xx, , yy, yawYaw]) {
  const place = 2 * Math.sqrt(Math.max(xx, yy, 0));
  const turn = 2 * format.degrees(Math.sqrt(Math.max(yawYaw, 0)));
  return `± ${format.length(place)} · ± ${turn.toFixed(1)}°`;
}

function errorText(pose, truth) {
  const away = Math.hypot(pose[0] - truth[0], pose[1] - truth[1]);
  const turned = pose[2] - truth[2];
  const angle = Math.abs(format.degrees(Math.atan2(Math.sin(turned), Math.cos(turned))));
  return `${format.length(away)} · ${angle.toFixed(1)}°`;
}

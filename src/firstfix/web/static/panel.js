/** The panel: state, why, evidence, places and figures. */

import * as words from "./words.js";

const EVERY_MS = 250; // figures that change faster cannot be read
const SILENT_AFTER_MS = 3000;
const KINDS = ["explained", "short", "through_wall", "unknown"];

const byId = (id) => document.getElementById(id);

function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export class Panel {
  #shownName = "";
  #state = null;
  #timer = 0;
  #heardAt = 0;

  /**
   * @param {object} on onPick(id), onMark(id), onNewState(text for a screen reader)
   */
  constructor(on) {
    this.on = on;
    setInterval(() => this.#showSilence(), 1000);
  }

  showMap(map) {
    const size = `${map.width} × ${map.height} cells of ${+(100 * map.resolution).toFixed(2)} cm`;
    setText(byId("map-name"), map.name);
    byId("map-name").title = `${map.name}: ${size}`;
    document.title = `firstfix · ${map.name}`;
  }

  /** Show a state: at once if it is another one, else with the next turn. */
  show(state) {
    this.#state = state;
    this.#heardAt = performance.now();
    if (state.state !== this.#shownName) this.#render();
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
    this.#showSilence();
  }

  #showState(state) {
    const name = state.state;
    const { word, icon, verdict } = words.wordsOfState(name);
    byId("app").dataset.state = name;
    setText(byId("state-word"), word);
    byId("state-icon").setAttribute("href", `#${icon}`);
    setText(byId("verdict"), verdict);
    setText(byId("reason"), sentence(state.reason));
    const places = name === "DISAMBIGUATING" ? `${state.hypotheses.length} places` : "";
    setText(byId("state-note"), places);
    byId("state-note").hidden = !places;
    byId("paused").hidden = !state.paused;
    const advice = state.motion && name === "DISAMBIGUATING" ? words.motionText(state.motion) : "";
    setText(byId("advice"), advice);
    byId("advice").hidden = !advice;
    setText(byId("pause-text"), state.paused ? "Go on" : "Pause");
    byId("pause").setAttribute("aria-pressed", String(Boolean(state.paused)));
    byId("pause-icon").setAttribute("href", state.paused ? "#i-play" : "#i-pause");
    if (name === this.#shownName) return;
    this.#shownName = name;
    this.on.onNewState(`${word.toLowerCase()}. ${verdict} ${sentence(state.reason)}`);
  }

  #showPlaces(state) {
    const places = state.state === "LOCALIZED" ? [] : state.hypotheses;
    byId("places").hidden = places.length === 0;
    const list = byId("places-list");
    while (list.children.length > places.length) list.lastElementChild.remove();
    while (list.children.length < places.length) list.append(this.#newPlace());
    places.forEach((place, i) => {
      const button = list.children[i].firstElementChild;
      button.dataset.id = place.id;
      const [number, chance, where] = button.children;
      setText(number, String(i + 1));
      setText(chance, words.percent(place.probability));
      const fits = place.explained == null ? "" : `${words.percent(place.explained)} of the beams fit`;
      setText(where.firstElementChild, words.poseText(place.pose));
      setText(where.lastElementChild, fits);
    });
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
      button.addEventListener(event, () => this.on.onMark(id()));
    }
    for (const event of ["blur", "pointerleave"]) {
      button.addEventListener(event, () => this.on.onMark(null));
    }
    item.append(button);
    return item;
  }

  #showEvidence(evidence) {
    setText(byId("beams"), evidence ? `${evidence.beams} beams` : "");
    const said = [];
    for (const kind of KINDS) {
      const css = kind.replace("_", "-");
      const share = evidence ? evidence[kind] : 0;
      const text = evidence ? words.percent(share) : "–";
      const part = byId("evidence-bar").querySelector(`.${css}`);
      part.style.flexGrow = share;
      part.hidden = share === 0;
      const row = byId("legend").querySelector(`.${css}`);
      setText(row.querySelector("b"), text);
      said.push(`${text} ${row.querySelector("span").textContent}`);
    }
    const label = evidence ? said.join(", ") : "No scan has been judged yet";
    byId("evidence-bar").setAttribute("aria-label", label);
  }

  #showFigures(state) {
    const { pose, truth, covariance } = state;
    setText(byId("pose"), pose ? words.poseText(pose) : "–");
    setText(byId("spread"), pose && covariance ? spreadText(covariance) : "–");
    byId("error-row").hidden = !truth;
    setText(byId("error"), pose && truth ? errorText(pose, truth) : "–");
    const fix = state.time_to_fix_s;
    setText(byId("time-to-fix"), fix == null ? "–" : words.seconds(fix));
    setText(byId("cpu"), state.cpu_ms == null ? "–" : `${state.cpu_ms.toFixed(1)} ms`);
    setText(byId("particles"), state.particles ? state.particles.toLocaleString("en") : "–");
    setText(byId("viewers"), String(state.viewers ?? 1));
  }

  #showSilence() {
    const silent = performance.now() - this.#heardAt;
    const tells = this.#state && !this.#state.paused && silent > SILENT_AFTER_MS;
    byId("silence").hidden = !tells;
    if (tells) setText(byId("silence"), `Nothing heard for ${Math.floor(silent / 1000)} s.`);
  }
}

function child(tag, className) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  return element;
}

function sentence(text) {
  if (!text) return "";
  const words = text.replaceAll("_", " "); // wheel_drop is a name for programs
  const first = words.charAt(0).toUpperCase() + words.slice(1);
  return /[.!?]$/.test(first) ? first : `${first}.`;
}

function spreadText([xx, , yy, yawYaw]) {
  const place = 2 * Math.sqrt(Math.max(xx, yy, 0));
  const turn = 2 * words.degrees(Math.sqrt(Math.max(yawYaw, 0)));
  return `± ${words.length(place)} · ± ${turn.toFixed(1)}°`;
}

function errorText(pose, truth) {
  const away = Math.hypot(pose[0] - truth[0], pose[1] - truth[1]);
  const turned = pose[2] - truth[2];
  const angle = Math.abs(words.degrees(Math.atan2(Math.sin(turned), Math.cos(turned))));
  return `${words.length(away)} · ${angle.toFixed(1)}°`;
}

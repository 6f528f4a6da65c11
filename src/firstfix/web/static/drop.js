/** Files of a viewer: a map and a log are sent once, located, and kept in this tab only. */

import { emptyFrame } from "./scene.js";
import { authorization } from "./token.js";

const STATES = { UNIQUE: "LOCALIZED", AMBIGUOUS: "DISAMBIGUATING", NO_MATCH: "SEARCHING" };
const MAP = /\.ya?ml$/i;
const IMAGE = /\.(pgm|png|bmp|ppm|pbm)$/i;
const LOG = /\.(npz|bag|db3|mcap|log|clf|carmen)$/i;
const MOST_BYTES = 64 * 2 ** 20;
const ACCEPTED = "a map (YAML and image), and a bag, .npz or CARMEN log";

const byId = (id) => document.getElementById(id);

export class Drop {
  #files = { map: null, image: null, log: null };
  #index = 0;
  #request = null; // of the search that runs

  /**
   * @param {object} on onLocated(frame) with the answer, onLeave(), onProblem(text)
   */
  constructor(on) {
    this.on = on;
    byId("files").addEventListener("change", () => {
      this.take([...byId("files").files]);
      byId("files").value = ""; // the same file can be chosen again
    });
    byId("open-files").addEventListener("click", () => byId("files").click());
    byId("file-previous").addEventListener("click", () => this.#locate(this.#index - 1));
    byId("file-next").addEventListener("click", () => this.#locate(this.#index + 1));
    byId("file-leave").addEventListener("click", () => this.leave());
    this.#listenToDrags();
  }

  get isOpen() {
    return !byId("dropped").hidden;
  }

  /** Take files; those of before stay where no new one replaces them. */
  take(files) {
    const known = { ...this.#files };
    for (const file of files) {
      const kind = MAP.test(file.name) ? "map" : IMAGE.test(file.name) ? "image" : LOG.test(file.name) ? "log" : null;
      if (kind === null) {
        this.on.onProblem(`${file.name} is of no known kind. Drop ${ACCEPTED}.`);
        return;
      }
      known[kind] = file;
    }
    const size = Object.values(known).reduce((sum, file) => sum + (file?.size ?? 0), 0);
    if (size > MOST_BYTES) {
      this.on.onProblem(`The files have ${Math.ceil(size / 2 ** 20)} MiB. The limit is ${MOST_BYTES / 2 ** 20} MiB.`);
      return;
    }
    this.#files = known;
    this.#locate(0);
  }

  leave() {
    if (!this.isOpen) return;
    this.#request?.abort();
    this.#files = { map: null, image: null, log: null };
    byId("dropped").hidden = true;
    this.on.onLeave();
  }

  #missing() {
    const { map, image, log } = this.#files;
    if (!log) return "Now drop a bag or a log with scans.";
    if (map && !image) return `Now drop the image that ${map.name} names.`;
    if (image && !map) return `Now drop the YAML of ${image.name}.`;
    return "";
  }

  async #locate(index) {
    this.#request?.abort();
    const files = Object.values(this.#files).filter(Boolean);
    this.#show(this.#missing() || "Locating …", null);
    if (this.#missing()) return;
    this.#request = new AbortController();
    const { signal } = this.#request;
    try {
      const located = await send(files, index, signal);
      this.#index = index;
      const frame = await frameOf(located, this.#files.map !== null);
      if (!signal.aborted) {
        this.#show(`Scan ${index + 1} of ${located.scans} in ${located.log}. Nothing is stored.`, located.scans);
        this.on.onLocated(frame);
      }
    } catch (problem) {
      if (signal.aborted) return;
      this.leave();
      this.on.onProblem(problem.message);
    }
  }

  #show(text, scans) {
    byId("dropped").hidden = false;
    byId("dropped-text").textContent = text;
    byId("file-previous").hidden = scans === null || this.#index === 0;
    byId("file-next").hidden = scans === null || this.#index + 1 >= scans;
  }

  #listenToDrags() {
    const hasFiles = (event) => event.dataTransfer?.types.includes("Files");
    addEventListener("dragover", (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      byId("app").dataset.dropping = "true";
    });
    addEventListener("dragleave", (event) => {
      if (!event.relatedTarget) byId("app").dataset.dropping = "false";
    });
    addEventListener("drop", (event) => {
      byId("app").dataset.dropping = "false";
      if (!hasFiles(event)) return;
      event.preventDefault();
      this.take([...event.dataTransfer.files]);
    });
  }
}

async function send(files, index, signal) {
  const query = new URLSearchParams({ index });
  for (const { name, size } of files) query.append("file", `${name}:${size}`);
  const request = {
    method: "POST",
    body: new Blob(files),
    headers: { ...authorization(), "Content-Type": "application/octet-stream" },
    signal,
  };
  let answer;
  try {
    answer = await fetch(`/v1/locate-files?${query}`, request);
  } catch {
    throw new Error("The files could not be sent: no connection to the robot.");
  }
  const content = await answer.json().catch(() => null);
  if (!answer.ok) throw new Error(content?.detail ?? `The robot answered with status ${answer.status}.`);
  return content;
}

/** An answer as the scene draws it: like a state of the robot, in a map of its own. */
async function frameOf({ map, png, ends, classes, answer }, hasOwnMap) {
  const best = answer.hypotheses[0];
  const isUnique = answer.verdict === "UNIQUE";
  const state = {
    state: STATES[answer.verdict],
    word: answer.verdict,
    reason: answer.reason,
    pose: isUnique ? best.pose : null,
    covariance: isUnique ? upper(best.covariance) : null,
    hypotheses: answer.hypotheses.map(({ pose, probability, evidence }, id) => {
      return { id, pose, probability, explained: evidence.explained };
    }),
    rivals: isUnique ? 1 : 0,
    chosen_by: null,
    evidence: best?.evidence ?? null,
    belief: null,
    particles: 0,
    cpu_ms: null,
    time_to_fix_s: answer.elapsed_s,
    motion: null,
    truth: null,
    paused: false,
    simulation: null,
    amcl: null,
    viewers: null,
  };
  const scan = { kind: "scan", count: classes.length, values: Float32Array.from(ends.flat()), classes };
  const frame = { ...emptyFrame(), state, scan };
  if (!hasOwnMap) return frame;
  const bytes = Uint8Array.from(atob(png), (letter) => letter.charCodeAt(0));
  const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
  return { ...frame, map, image };
}

function upper([[xx, xy], [, yy], [, , yawYaw]]) {
  return [xx, xy, yy, yawYaw];
}

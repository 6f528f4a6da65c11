/** Notices over the map, and announcements of the screen reader. */

const ERROR_MS = 6000;
const SPEAK_EVERY_MS = 1200;

const byId = (id) => document.getElementById(id);

export class Notices {
  #errorTimer = 0;
  #answerTimer = 0;
  #place = [0, 0];
  #countdown = 0;
  #speakTimer = 0;
  #spoken = "";
  #wanted = "";

  showMode(mode) {
    byId("mode-hint").hidden = mode === null;
    if (mode === null) return;
    byId("mode-text").textContent = mode.text;
    byId("mode-keys").textContent = mode.keys;
    this.speak(`${mode.text} ${mode.keys}`);
  }

  /** A command that was refused, and why. */
  showError(text) {
    const box = byId("error-notice");
    box.textContent = text;
    box.hidden = false;
    clearTimeout(this.#errorTimer);
    this.#errorTimer = setTimeout(() => (box.hidden = true), ERROR_MS);
  }

  /** Answer a command where the person clicked: [x, y] of the map. */
  showAnswer(text, place) {
    this.#place = place;
    byId("answer").textContent = text;
    byId("answer").hidden = false;
    clearTimeout(this.#answerTimer);
    this.#answerTimer = setTimeout(() => (byId("answer").hidden = true), ERROR_MS);
  }

  /** Keep the answer at its place, and inside of the window. */
  placeAnswer(view) {
    const box = byId("answer");
    if (box.hidden) return;
    const [px, py] = view.toScreen(...this.#place);
    const half = box.offsetWidth / 2 + 8;
    box.style.left = `${Math.min(Math.max(px, half), view.width - half)}px`;
    box.style.top = `${Math.min(Math.max(py, 0), view.height - box.offsetHeight - 22)}px`;
  }

  showLost(waitMs) {
    clearInterval(this.#countdown);
    const until = performance.now() + waitMs;
    const show = () => {
      const left = Math.max(Math.ceil((until - performance.now()) / 1000), 0);
      byId("connection-text").textContent =
        left > 0 ? `No connection to the robot. Retrying in ${left} s.` : "No connection to the robot. Retrying …";
    };
    show();
    this.#countdown = setInterval(show, 500);
    if (byId("connection-lost").hidden) this.speak("Connection to the robot lost.");
    byId("connection-lost").hidden = false;
    byId("last-known").hidden = false; // what is shown was true when the connection broke
  }

  hideLost() {
    clearInterval(this.#countdown);
    if (!byId("connection-lost").hidden) this.speak("Connected again.");
    byId("connection-lost").hidden = true;
    byId("last-known").hidden = true;
  }

  /** Announce to screen readers: the newest text only, at a limited rate. */
  speak(text) {
    this.#wanted = text;
    if (this.#speakTimer) return;
    this.#say();
    this.#speakTimer = setInterval(() => this.#say(), SPEAK_EVERY_MS);
  }

  #say() {
    if (this.#wanted === this.#spoken) {
      clearInterval(this.#speakTimer);
      this.#speakTimer = 0;
      return;
    }
    this.#spoken = this.#wanted;
    byId("spoken").textContent = this.#spoken;
  }
}

/** What must be said across the map, and what a screen reader says. */

const COMPLAINT_MS = 6000;
const SPEAK_EVERY_MS = 1200;

const byId = (id) => document.getElementById(id);

export class Notices {
  #complaintTimer = 0;
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

  /** Something that a person asked for cannot be done. */
  complain(text) {
    const box = byId("complaint");
    box.textContent = text;
    box.hidden = false;
    clearTimeout(this.#complaintTimer);
    this.#complaintTimer = setTimeout(() => (box.hidden = true), COMPLAINT_MS);
  }

  showLost(waitMs) {
    clearInterval(this.#countdown);
    const until = performance.now() + waitMs;
    const tell = () => {
      const left = Math.max(Math.ceil((until - performance.now()) / 1000), 0);
      byId("connection-text").textContent =
        left > 0 ? `No connection to the robot. Next try in ${left} s.` : "No connection. Trying …";
    };
    tell();
    this.#countdown = setInterval(tell, 500);
    if (byId("connection-lost").hidden) this.speak("The connection to the robot is lost.");
    byId("connection-lost").hidden = false;
  }

  hideLost() {
    clearInterval(this.#countdown);
    if (!byId("connection-lost").hidden) this.speak("Connected again.");
    byId("connection-lost").hidden = true;
  }

  /** For screen readers: the newest only, and not too often. */
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

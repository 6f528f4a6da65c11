/** On a phone the panel is a sheet at the bottom: a head that stays, and details to pull up. */

const NARROW = "(max-width: 719px)";
const SWIPE_PX = 24;

export class Sheet {
  #panel = document.getElementById("panel");
  #handle = document.getElementById("sheet-handle");
  #narrow = matchMedia(NARROW);
  #headPx = 0;
  #startY = 0;
  #swiped = false;

  constructor(onChange) {
    this.onChange = onChange;
    this.#handle.addEventListener("click", () => {
      if (!this.#swiped) this.#open(!this.isOpen);
      this.#swiped = false;
    });
    this.#listenToSwipes();
    this.#narrow.addEventListener("change", onChange);
    new ResizeObserver(onChange).observe(this.#panel);
  }

  get isNarrow() {
    return this.#narrow.matches;
  }

  get isOpen() {
    return this.#handle.getAttribute("aria-expanded") === "true";
  }

  /** Show the map again. */
  close() {
    if (this.isNarrow && this.isOpen) this.#open(false);
  }

  /** How much of the window the panel and the bars cover, px. */
  covered() {
    const box = this.#panel.getBoundingClientRect();
    const tools = document.getElementById("tools");
    const view = document.getElementById("view-tools").getBoundingClientRect();
    if (!this.isNarrow) {
      const bottom = tools.hidden ? 0 : tools.offsetHeight;
      return { left: view.right, top: 0, right: innerWidth - box.left, bottom };
    }
    const state = document.getElementById("state").getBoundingClientRect();
    // The head only grows with its texts, so that the buttons above it do not move.
    this.#headPx = Math.max(this.#headPx, state.bottom - box.top + 10);
    document.getElementById("app").style.setProperty("--sheet-head", `${this.#headPx}px`);
    const bottom = this.#headPx + (tools.hidden ? 0 : tools.offsetHeight + 8);
    return { left: 0, top: 0, right: 0, bottom };
  }

  #open(open) {
    this.#handle.setAttribute("aria-expanded", String(open));
    this.#panel.dataset.open = String(open);
    this.#handle.setAttribute("aria-label", open ? "Hide details" : "Show details");
    this.onChange();
  }

  #listenToSwipes() {
    this.#handle.addEventListener("pointerdown", (event) => {
      this.#startY = event.clientY;
      this.#swiped = false;
      this.#handle.setPointerCapture(event.pointerId);
    });
    this.#handle.addEventListener("pointerup", (event) => {
      const up = this.#startY - event.clientY;
      if (Math.abs(up) < SWIPE_PX) return;
      this.#swiped = true;
      this.#open(up > 0);
    });
  }
}

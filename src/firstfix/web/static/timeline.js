/** The timeline, newest event first. */

import { stampText } from "./format.js";

const MOST = 200;

export class Timeline {
  #list = document.getElementById("events");
  #empty = document.getElementById("no-events");
  #newest = -1;

  replace(events) {
    this.#list.replaceChildren();
    this.#newest = -1;
    for (const event of events) this.add(event);
    this.#empty.hidden = this.#list.children.length > 0;
  }

  /** Add an event, unless `hello` had it already. */
  add({ number, stamp, kind, text }) {
    if (number <= this.#newest) return;
    this.#newest = number;
    const item = document.createElement("li");
    item.dataset.kind = kind;
    const time = document.createElement("time");
    time.textContent = stampText(stamp);
    const words = document.createElement("span");
    words.textContent = text;
    item.append(time, words);
    this.#list.prepend(item);
    if (this.#list.children.length > MOST) this.#list.lastElementChild.remove();
    this.#empty.hidden = true;
  }
}

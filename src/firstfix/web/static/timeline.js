/** What happened, newest first. */

import { stampText } from "./words.js";

const MOST = 200;

export class Timeline {
  #list = document.getElementById("events");
  #empty = document.getElementById("no-events");

  replace(events) {
    this.#list.replaceChildren();
    for (const event of events) this.add(event);
    this.#empty.hidden = this.#list.children.length > 0;
  }

  add({ stamp, kind, text }) {
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

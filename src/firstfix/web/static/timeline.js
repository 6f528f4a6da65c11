/** The timeline, newest event first; events of one kind in a row are folded. */

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
  add(event) {
    if (event.number <= this.#newest) return;
    this.#newest = event.number;
    const item = row(event);
    const before = this.#list.firstElementChild;
    if (before?.dataset.sort === item.dataset.sort) fold(item, before);
    this.#list.prepend(item);
    this.#drop();
    this.#empty.hidden = true;
  }

  /** Drop the oldest ones beyond the limit, folded ones included. */
  #drop() {
    while (this.#list.querySelectorAll("li").length > MOST) {
      const last = this.#list.lastElementChild;
      const oldest = last.querySelector("ol")?.lastElementChild ?? last;
      oldest.remove();
      if (oldest !== last) label(last);
    }
  }
}

function row({ stamp, kind, text }) {
  const item = document.createElement("li");
  item.dataset.kind = kind;
  item.dataset.stamp = stamp;
  item.dataset.sort = `${kind} ${sortOf(text)}`;
  item.title = "Look at this moment";
  const time = document.createElement("time");
  time.textContent = stampText(stamp);
  const words = document.createElement("span");
  words.textContent = text;
  item.append(time, words);
  return item;
}

/** Two texts are of one kind if they differ in numbers, or behind a colon, only. */
function sortOf(text) {
  return text.split(":")[0].replace(/[−-]?\d+(\.\d+)?/g, "#");
}

/** Put the row before, and what it had folded, behind a button of the new row. */
function fold(item, before) {
  const older = before.querySelector("ol") ?? document.createElement("ol");
  const button = before.querySelector("button") ?? opener();
  button.remove();
  older.remove();
  older.prepend(before);
  item.append(button, older);
  label(item);
}

function opener() {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "fold";
  button.setAttribute("aria-expanded", "false");
  button.addEventListener("click", () => {
    const isOpen = button.getAttribute("aria-expanded") === "true";
    button.setAttribute("aria-expanded", String(!isOpen));
    label(button.parentElement);
  });
  return button;
}

function label(item) {
  const [button, older] = [item.querySelector("button"), item.querySelector("ol")];
  const isOpen = button.getAttribute("aria-expanded") === "true";
  older.hidden = !isOpen;
  const count = older.children.length;
  button.hidden = count === 0;
  button.textContent = isOpen ? "show less" : `${count} earlier`;
  button.setAttribute("aria-label", isOpen ? "Hide earlier events like this" : `Show ${count} earlier like this`);
}

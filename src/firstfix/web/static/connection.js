/** The WebSocket: reconnects, and asks for a token where one is needed. */

import { readFrame } from "./frames.js";
import { authorization, token } from "./token.js";

const FIRST_WAIT_MS = 400;
const LONGEST_WAIT_MS = 8000;
const NO_TOKEN = 4401; // close code: the token is missing or wrong

export class Connection {
  #socket = null;
  #wait = FIRST_WAIT_MS;
  #timer = 0;

  /**
   * @param {object} listener with onMessage(object), onFrame(frame), onLost(waitMs) and onTokenAsked()
   */
  constructor(listener) {
    this.listener = listener;
  }

  open() {
    clearTimeout(this.#timer);
    const url = new URL("/v1/live", location.href);
    url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(url);
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    // Browsers cannot add headers to a WebSocket, and a token in the URL would be logged. An empty
    // token is sent, too, so that a server that needs one refuses at once.
    socket.onopen = () => this.send({ type: "token", token: token() ?? "" });
    socket.onmessage = ({ data }) => this.#take(data);
    socket.onclose = ({ code }) => {
      if (socket === this.#socket) this.#lost(code);
    };
  }

  /** Send a message; false if there is no connection. */
  send(message) {
    if (this.#socket?.readyState !== WebSocket.OPEN) return false;
    this.#socket.send(JSON.stringify(message));
    return true;
  }

  #take(data) {
    if (typeof data !== "string") {
      const frame = readFrame(data);
      if (frame) this.listener.onFrame(frame);
      return;
    }
    const message = JSON.parse(data);
    if (message.type === "hello") this.#wait = FIRST_WAIT_MS;
    this.listener.onMessage(message);
  }

  async #lost(code) {
    this.#socket = null;
    if (code === NO_TOKEN || (await refusesToken())) {
      this.listener.onTokenAsked();
      return;
    }
    if (this.#socket) return; // opened by the user meanwhile
    const wait = this.#wait;
    this.#wait = Math.min(2 * wait, LONGEST_WAIT_MS);
    this.#timer = setTimeout(() => this.open(), wait * (0.8 + 0.4 * Math.random()));
    this.listener.onLost(wait);
  }
}

/** A refused WebSocket has no reason; a plain request has. */
async function refusesToken() {
  try {
    const answer = await fetch("/v1/status", { headers: authorization(), cache: "no-store" });
    return answer.status === 401;
  } catch {
    return false;
  }
}

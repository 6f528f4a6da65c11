/** What has changed in the map since it was made: an image over the map, fetched while it is shown. */

import { authorization } from "../token.js";
import { drawOver } from "./map.js";

const EVERY_MS = 5000;

/** Keeps the image of the changes of the map in use up to date. */
export class Changes {
  #timer = null;
  #map = null;
  image = null;

  constructor(onChange) {
    this.onChange = onChange;
  }

  /** Fetch for this map from now on, or for none (null). */
  show(map) {
    if (map === this.#map) return;
    this.#map = map;
    this.image = null;
    clearInterval(this.#timer);
    if (map) {
      this.#fetch(map);
      this.#timer = setInterval(() => this.#fetch(map), EVERY_MS);
    }
    this.onChange();
  }

  async #fetch(map) {
    try {
      const answer = await fetch(map.changes, { headers: authorization() });
      if (!answer.ok) return;
      const image = await createImageBitmap(await answer.blob());
      if (map !== this.#map) return; // hidden, or another map, meanwhile
      this.image = image;
      this.onChange();
    } catch {
      // Offline: the last image stays, and the page says that it is offline.
    }
  }
}

/** Draw the changes; the image has the pixels of that of the map. */
export function drawChanges(ctx, view, map, image) {
  drawOver(ctx, view, map, image);
}

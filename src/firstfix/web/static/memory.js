/** What the browser keeps for the page; nothing, where it is told to keep nothing. */

/** @param {"localStorage"|"sessionStorage"} store */
export function recall(store, key) {
  try {
    return window[store].getItem(key);
  } catch {
    return null;
  }
}

/** Keep a text, or forget it where it is null. */
export function keep(store, key, text) {
  try {
    if (text === null) window[store].removeItem(key);
    else window[store].setItem(key, text);
  } catch {
    // It is forgotten with the page then.
  }
}

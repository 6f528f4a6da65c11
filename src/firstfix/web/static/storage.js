/** Browser storage; empty where the browser does not allow it. */

/** @param {"localStorage"|"sessionStorage"} store */
export function recall(store, key) {
  try {
    return window[store].getItem(key);
  } catch {
    return null;
  }
}

/** Store a text; null removes it. */
export function keep(store, key, text) {
  try {
    if (text === null) window[store].removeItem(key);
    else window[store].setItem(key, text);
  } catch {
    // Then it is lost when the page is closed.
  }
}

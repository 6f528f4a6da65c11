/** The access token: kept for this tab, never in a URL that is sent or shown. */

import { keep, recall } from "./storage.js";

const KEY = "firstfix-token";

let known = recall("sessionStorage", KEY);

/** Take the token out of `#token=...`, and the fragment out of the address bar. */
export function takeTokenFromFragment() {
  const found = new URLSearchParams(location.hash.slice(1)).get("token");
  if (found === null) return;
  keepToken(found);
  history.replaceState(null, "", location.pathname + location.search);
}

/** @param {?string} text null to delete it */
export function keepToken(text) {
  known = text;
  keep("sessionStorage", KEY, text);
}

export function token() {
  return known;
}

/** Headers that carry the token, for fetch. */
export function authorization() {
  return known === null ? {} : { Authorization: `Bearer ${known}` };
}

/** The token that a robot may ask for: kept for this tab, never in a URL that is sent or seen. */

const KEY = "firstfix-token";

/** Take the token out of `#token=...`, and the fragment out of the address bar. */
export function takeTokenFromFragment() {
  const found = new URLSearchParams(location.hash.slice(1)).get("token");
  if (found === null) return;
  keepToken(found);
  history.replaceState(null, "", location.pathname + location.search);
}

export function keepToken(token) {
  sessionStorage.setItem(KEY, token);
}

export function forgetToken() {
  sessionStorage.removeItem(KEY);
}

export function token() {
  return sessionStorage.getItem(KEY);
}

/** Headers that carry the token, for fetch. */
export function authorization() {
  return token() === null ? {} : { Authorization: `Bearer ${token()}` };
}

/** Dark or light: as the system says, until somebody presses the button. */

const KEY = "firstfix-theme";
const BY_SYSTEM = "(prefers-color-scheme: dark)";
const NAMES = [
  "ground", "free", "wall", "grid", "surface", "text", "muted", "robot", "robot-ink", "particle",
  "trail", "truth", "ghost", "goal", "explained", "short", "through-wall", "unknown", "on-accent",
];

export class Theme {
  #sheet = document.getElementById("dark");
  #system = matchMedia(BY_SYSTEM);

  constructor() {
    this.onChange = () => {};
    this.colours = {}; // by name; the same object for good, its entries change
    this.#system.addEventListener("change", () => this.#apply());
    this.#apply();
  }

  get isDark() {
    const chosen = localStorage.getItem(KEY);
    return chosen === null ? this.#system.matches : chosen === "dark";
  }

  toggle() {
    const wanted = !this.isDark;
    if (wanted === this.#system.matches) localStorage.removeItem(KEY);
    else localStorage.setItem(KEY, wanted ? "dark" : "light");
    this.#apply();
  }

  #apply() {
    this.#sheet.media = this.isDark ? "all" : "not all";
    document.documentElement.style.colorScheme = this.isDark ? "dark" : "light";
    const style = getComputedStyle(document.documentElement);
    for (const name of NAMES) this.colours[name] = style.getPropertyValue(`--${name}`).trim();
    this.onChange();
  }
}

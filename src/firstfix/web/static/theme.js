/** Dark or light: the setting of the system, until the button is pressed. */

import { keep, recall } from "./storage.js";

const KEY = "firstfix-theme";
const BY_SYSTEM = "(prefers-color-scheme: dark)";
const NAMES = [
  "ground", "free", "wall", "grid", "surface", "text", "muted", "robot", "robot-ink", "particle",
  "trail", "truth", "chosen", "hypothesis", "goal", "amcl", "explained", "short", "through-wall", "unknown", "on-accent",
];

export class Theme {
  #sheet = document.getElementById("dark");
  #system = matchMedia(BY_SYSTEM);
  #chosen = recall("localStorage", KEY);

  constructor() {
    this.onChange = () => {};
    this.colours = {}; // by name; the same object for good, its entries change
    this.#system.addEventListener("change", () => this.#apply());
    // A style sheet whose media query does not match is loaded last.
    this.#sheet.addEventListener("load", () => this.#apply());
    this.#apply();
  }

  get isDark() {
    return this.#chosen === null ? this.#system.matches : this.#chosen === "dark";
  }

  toggle() {
    const next = this.isDark ? "light" : "dark";
    const asSystem = (next === "dark") === this.#system.matches;
    this.#chosen = asSystem ? null : next;
    keep("localStorage", KEY, this.#chosen);
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

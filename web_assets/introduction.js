// Five steps for whoever opens the console for the first time. It covers no control and blocks none.

import { openTab } from "./panel_tabs.js";
import { say } from "./words.js";

const KEY = "ippon-introduction";
const DONE = "done";
// Each with the tab that it is about.
const STEPS = [
  ["search", "search"], ["why", "map"], ["steer", "drive"], ["confirm", "search"], ["review", "session"],
];

const at = (id) => document.getElementById(id);

export class Introduction {
  constructor(view) {
    this.view = view;
    this.box = at("introduction");
    at("introduction-next").addEventListener("click", () => this.go(this.step + 1));
    at("introduction-back").addEventListener("click", () => this.go(this.step - 1));
    at("introduction-end").addEventListener("click", () => this.go(STEPS.length));
    at("introduction-again").addEventListener("click", () => {
      at("help").close();
      this.go(0);
    });
    const kept = localStorage.getItem(KEY);
    this.step = kept === DONE ? STEPS.length : Number(kept ?? 0);
    this.begun = false;
  }

  // Escape closes the card wherever the focus is, unless something over it takes the key.
  onKey(event) {
    if (event.key !== "Escape" || this.box.hidden) return;
    if (!document.querySelector("dialog[open], body[data-side]")) this.go(STEPS.length);
  }

  // Begin once there is something to see.
  begin() {
    if (this.begun) return;
    this.begun = true;
    if (this.step < STEPS.length) this.go(this.step, false);
  }

  go(step, hasAsked = true) {
    this.begun = true;
    this.step = Math.max(0, step);
    const one = STEPS[this.step];
    localStorage.setItem(KEY, one ? String(this.step) : DONE);
    this.box.hidden = one === undefined;
    if (one === undefined) {
      // The next thing to do is there: type what to find, or judge a find.
      openTab(this.view, "search");
      return;
    }
    const [name, tab] = one;
    at("introduction-title").textContent = say(`introduction.${name}`);
    at("introduction-text").textContent = say(`introduction.${name}.text`);
    at("introduction-count").textContent = say("introduction.count", {
      n: this.step + 1, all: STEPS.length,
    });
    at("introduction-back").disabled = this.step === 0;
    at("introduction-next").textContent = say(
      this.step + 1 < STEPS.length ? "introduction.next" : "introduction.done",
    );
    if (!hasAsked) return;
    openTab(this.view, tab);
    at("introduction-next").focus();
  }
}

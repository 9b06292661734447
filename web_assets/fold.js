// On an upright tablet the panel is below the map; this collapses it to its tabs.

import { onScene, onSceneElement } from "./scene_frame.js";
import { say } from "./words.js";

const at = (id) => document.getElementById(id);

export function installFold(view) {
  const button = at("fold");
  const fold = (folded) => {
    document.body.toggleAttribute("data-folded", folded);
    const word = say(folded ? "fold.expand" : "fold.collapse");
    button.title = word;
    button.setAttribute("aria-label", word);
    button.textContent = folded ? "▴" : "▾";
    view.contentDocument?.documentElement?.toggleAttribute("data-ip-folded", folded);
  };
  const isFolded = () => document.body.hasAttribute("data-folded");
  button.addEventListener("click", () => fold(!isFolded()));
  fold(isFolded());
  onSceneElement(() => fold(isFolded()));
  // Pressing a tab expands a collapsed panel.
  onScene((inner) => inner.addEventListener("click", (event) => {
    if (isFolded() && event.target.closest?.('[role="tab"]')) fold(false);
  }));
}

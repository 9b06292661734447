// The help dialog, and the light and dark themes; the system's setting is the default.

import { onSceneElement } from "./scene_frame.js";
import { chooseTheme, chosenTheme, light } from "./theme.js";
import { say } from "./words.js";

const at = (id) => document.getElementById(id);

export function installHelp(isTyping) {
  const dialog = at("help");
  const toggle = () => (dialog.open ? dialog.close() : dialog.showModal());
  at("help-open").addEventListener("click", toggle);
  at("help-close").addEventListener("click", () => dialog.close());
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  return (event) => {
    if (event.key !== "?" || isTyping(event.target)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    toggle();
  };
}

// The scene's client has the same origin, so its colours can be switched in place.
// tell: told the theme; returns what tells it again.
export function installTheme(view, tell) {
  // viser's panels follow an attribute that viser sets; this sets it back to the chosen theme.
  const paint = () => {
    const marks = view.contentDocument?.documentElement?.dataset ?? {};
    if (marks.mantineColorScheme !== chosenTheme()) marks.mantineColorScheme = chosenTheme();
    marks.ipTheme = chosenTheme();
  };
  const show = () => {
    const theme = chosenTheme();
    document.documentElement.dataset.theme = theme;
    at("theme").title = say(theme === "dark" ? "theme.light" : "theme.dark");
    paint();
    tell(theme);
  };
  at("theme").addEventListener("click", () => {
    chooseTheme(chosenTheme() === "dark" ? "light" : "dark");
    show();
  });
  light.addEventListener("change", show);
  show();
  onSceneElement((root) => {
    show();
    new MutationObserver(paint).observe(root, {
      attributes: true, attributeFilter: ["data-mantine-color-scheme"],
    });
  });
  return () => tell(chosenTheme());
}

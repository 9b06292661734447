// The tabs of the panel beside the scene.

import { say } from "./words.js";

let wanted = "";

// Opens a tab by its name in the code, such as "search", as soon as it is there: on a slow machine
// the panel comes later than the page.
export function openTab(view, name, tries = 100) {
  wanted = name;
  const tabs = view.contentDocument?.querySelectorAll('[role="tab"]') ?? [];
  const tab = [...tabs].find((one) => one.textContent.trim() === say(`tab.${name}`));
  if (tab === undefined && tries > 0) {
    setTimeout(() => wanted === name && openTab(view, name, tries - 1), 100);
  }
  // viser's tabs can be dragged: they are pressed by a pointer, not by a click.
  for (const kind of ["pointerdown", "pointerup", "click"]) {
    tab?.dispatchEvent(new PointerEvent(kind, { bubbles: true, isPrimary: true, pointerId: 1 }));
  }
}

// Opens the Search tab and scrolls to a part of it, as soon as that is there.
export function openSearchAt(view, selector, tries = 20) {
  openTab(view, "search");
  const look = (left) => {
    const part = view.contentDocument?.querySelector(selector);
    if (part?.checkVisibility()) part.scrollIntoView({ block: "nearest" });
    else if (left > 0) setTimeout(() => look(left - 1), 100);
  };
  look(tries);
}

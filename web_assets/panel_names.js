// Names for the fields of the panels, which viser ties to no label: screen readers say the label beside.

import { say } from "./words.js";

const FIELDS = ["input", "textarea", "[role='slider']"].join();
// What viser's client itself says, in English only.
const OWN = [["Collapse panel", "fold.collapse"], ["Expand panel", "fold.expand"]];
const UNNAMED = ":not([aria-label]), [aria-label='']";

// A label is the first one of the closest part of the panel that has one.
function labelOf(field) {
  for (let part = field.parentElement; part; part = part.parentElement) {
    const label = part.querySelector("label");
    if (label) return label.htmlFor && label.htmlFor === field.id ? null : label.textContent.trim();
  }
  return null;
}

export function nameFields(inner) {
  const name = () => {
    for (const field of inner.querySelectorAll(`:is(${FIELDS}):is(${UNNAMED})`)) {
      const label = labelOf(field);
      if (label) field.setAttribute("aria-label", label);
    }
    for (const [theirs, key] of OWN) {
      for (const one of inner.querySelectorAll(`[aria-label^="${theirs}"]`)) {
        if (one.getAttribute("aria-label") !== say(key)) one.setAttribute("aria-label", say(key));
      }
    }
  };
  let timer = 0;
  new MutationObserver(() => {
    timer ||= setTimeout(() => {
      timer = 0;
      name();
    }, 300);
  }).observe(inner.body, {
    childList: true, subtree: true, attributes: true, attributeFilter: ["aria-label"],
  });
  name();
}

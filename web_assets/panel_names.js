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

// A sentence needs the whole width, and an example says that it may be one.
function widen(inner) {
  for (const label of inner.querySelectorAll("label")) {
    if (label.textContent.trim() !== say("field.find")) continue;
    let row = label.parentElement;
    while (row && !row.querySelector("input, textarea")) row = row.parentElement;
    const field = row?.querySelector("input, textarea");
    if (!field || field.placeholder) continue;
    field.placeholder = say("field.find.example");
    row.dataset.ipSentence = "";
  }
}

export function nameFields(inner) {
  const name = () => {
    widen(inner);
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
  }).observe(inner, {
    childList: true, subtree: true, attributes: true, attributeFilter: ["aria-label"],
  });
  name();
}

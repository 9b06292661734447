// Tells of each document of the scene's frame as soon as it is there: half read, or without any element.
// Keys that a person presses in it meanwhile count, too.

import { BASE } from "./base.js";

const CLOSED = "about:blank";
const LOOK_MS = 50;
const view = document.getElementById("view");
const acts = [];
let known = null;

function look() {
  const inner = view.contentDocument;
  if (inner === null || inner === known || inner.location.pathname !== `${BASE}view/`) return;
  known = inner;
  for (const act of acts) act(inner);
}

// act: called with each document, in the order in which acts are given here.
export function onScene(act) {
  acts.push(act);
  if (known !== null) act(known);
  look();
}

// act: called with the element of each document once it has one.
export function onSceneElement(act) {
  onScene((inner) => {
    const begin = () => {
      if (inner.documentElement === null) return;
      watch.disconnect();
      act(inner.documentElement);
    };
    const watch = new MutationObserver(begin);
    watch.observe(inner, { childList: true });
    begin();
  });
}

// Closes the scene with its sockets, without waiting for a line that may be dead.
export function closeScene() {
  view.contentWindow.location.replace(CLOSED);
}

// Loads the scene again; the browser's own page of an error, where the scene could not be loaded, is
// of another origin.
export function reloadScene() {
  if ((view.contentDocument?.URL ?? CLOSED) === CLOSED) view.src = view.src;
  else view.contentWindow.location.reload();
}

view.addEventListener("load", look);
setInterval(look, LOOK_MS);

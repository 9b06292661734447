// Tells of each document of the scene's frame as soon as it is there: half read, or without any element.
// Keys that a person presses in it meanwhile count, too.

import { BASE } from "./base.js";

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

let closed = false;

// Closes the scene with its sockets, without waiting for a line that may be dead.
export function closeScene() {
  closed = true;
  view.contentWindow.location.replace("about:blank");
}

// Whether the scene was closed, or could not be loaded: the browser's own page of an error is of
// another origin.
export const isSceneGone = () => closed || view.contentDocument === null;

export function reloadScene() {
  const isGone = isSceneGone();
  closed = false;
  if (isGone) view.src = view.src;
  else view.contentWindow.location.reload();
}

view.addEventListener("load", look);
setInterval(look, LOOK_MS);

// What the page says over the scene.

import { decimal, say } from "./words.js";

// state: of the navigator, null without one; shown: word of the page's state; notDelivered: why a
// command was not delivered; mayJudge: whether this page has control. Returns title and text.
export function notice(state, shown, notDelivered, mayJudge) {
  if (notDelivered !== null) return [say("notice.undelivered"), notDelivered];
  if (state === null) return ["", ""];
  if (state.link === "stalled") {
    return [say("notice.stalled"), say("notice.stalled.text")];
  }
  if (state.link === "silent") {
    return [say("notice.silent"), say("notice.silent.text", { n: Math.round(state.silent_s) })];
  }
  if (state.warning) return [say("notice.versions"), state.warning];
  switch (shown) {
    case "stopped":
      return [say("notice.stopped"), say("notice.stopped.text")];
    case "found":
      return found(state, mayJudge);
    case "manual":
      return state.drive?.waypoint ? [say("notice.waypoint"), ""] : ["", ""];
    case "exhausted":
      return [say("notice.exhausted"), say("notice.exhausted.text")];
    case "lost":
      return [say("notice.lost"), state.why];
    case "ended":
      return [say("notice.ended"), state.why];
    case "paused":
      return [say("notice.paused"), state.why];
    default:
      return ["", ""];
  }
}

function found(state, mayJudge) {
  if (!state.find) return ["", ""];
  const judge = mayJudge ? say("notice.judge") : "";
  const { name, out_of_reach_m } = state.find;
  if (out_of_reach_m === null) return [say("notice.found", { object: name }), judge];
  const away = say("notice.unreachable.text", { n: decimal(out_of_reach_m, 1) });
  return [say("notice.unreachable", { object: name }), `${away} ${judge}`];
}

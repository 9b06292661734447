// What the page says over the scene, with buttons that lead on.

import { button } from "./side.js";
import { setText } from "./text.js";
import { decimal, say } from "./words.js";

const CLOSED = "ippon-closed-notices";
const at = (id) => document.getElementById(id);

export class Notice {
  // acts: what its buttons do, by name.
  constructor(acts) {
    this.state = null;
    this.acts = acts;
    this.shown = "";
    at("notice-close").addEventListener("click", () => this.close());
  }

  // Closed notices stay closed, also when the page is loaded again.
  close() {
    sessionStorage.setItem(CLOSED, JSON.stringify([...this.closed().slice(-20), this.key]));
    at("notice").hidden = true;
  }

  closed() {
    return JSON.parse(sessionStorage.getItem(CLOSED) ?? "[]");
  }

  // state: of the navigator, null without one; shown: word of the page's state; notDelivered: why a
  // command was not delivered; mayJudge: whether this page has control.
  render(state, shown, notDelivered, mayJudge) {
    this.state = state;
    const { key = "", title, text = "", acts = [], counts = false } = told(state, shown, notDelivered, mayJudge);
    this.key = key && `${state.instance} ${key}`;
    at("notice").hidden = !title || (key !== "" && this.closed().includes(this.key));
    setText(at("notice-title"), title);
    // Seconds that count up are not read out each time.
    at("notice-text").ariaLive = counts ? "off" : null;
    setText(at("notice-text"), text);
    at("notice-close").hidden = key === "";
    const now = JSON.stringify([key, acts]);
    if (now === this.shown) return;
    this.shown = now;
    const buttons = acts.map((name) => button(say(`notice.${name}`), say(`notice.${name}`), () => this.acts[name](this.state)));
    at("notice-acts").replaceChildren(...buttons);
  }
}

// Title and text; key: what the notice is about, for one that can be closed; acts: its buttons;
// counts: whether the text counts seconds.
function told(state, shown, notDelivered, mayJudge) {
  if (notDelivered !== null) return { title: say("notice.undelivered"), text: notDelivered };
  if (state === null) return { title: "" };
  if (state.link === "stalled") {
    return { title: say("notice.stalled"), text: say("notice.stalled.text") };
  }
  if (state.link === "silent") {
    const text = say("notice.silent.text", { n: Math.round(state.silent_s) });
    return { title: say("notice.silent"), text, counts: true };
  }
  const notice = toldOfRobot(state, shown, mayJudge);
  if (notice.title || !state.warning) return notice;
  return { key: `versions ${state.warning}`, title: say("notice.versions"), text: state.warning };
}

function toldOfRobot(state, shown, mayJudge) {
  switch (shown) {
    case "stopped":
      return { title: say("notice.stopped"), text: say("notice.stopped.text") };
    case "found":
    case "perhaps":
      return found(state.find, mayJudge);
    case "lost":
      return { title: say("notice.lost"), text: state.why };
    case "ended":
      return { title: say("notice.ended"), text: state.why };
    case "paused":
      return { title: say("notice.paused"), text: say("notice.paused.text") };
    default:
      if (state.drive?.waypoint) return { title: say("notice.waypoint") };
      // A tour goes on after a find, which waits all the same.
      return state.find ? found(state.find, mayJudge) : unfound(state.unfound);
  }
}

function found(find, mayJudge) {
  if (!find) return { title: "" };
  const judge = mayJudge ? say("notice.judge") : "";
  const acts = mayJudge ? ["show", "confirm", "reject"] : ["show"];
  const key = `find ${find.goal_id} ${find.position.map((part) => part.toFixed(2))}`;
  if (find.out_of_reach_m === null) {
    const title = say(find.perhaps ? "notice.perhaps" : "notice.found", { object: find.name });
    return { key, title, text: judge, acts };
  }
  const away = say("notice.unreachable.text", { n: decimal(find.out_of_reach_m, 1) });
  const title = say("notice.unreachable", { object: find.name });
  return { key, title, text: `${away} ${judge}`, acts };
}

// What was not found last, also while the robot goes on with the next goal.
function unfound(lost) {
  if (!lost) return { title: "" };
  return {
    // A navigator that was started again counts goals from 1.
    key: `unfound ${lost.goal_id} ${lost.took_s}`,
    title: say("notice.exhausted", { object: lost.name }),
    text: say("notice.exhausted.text"),
    acts: lost.places > 0 ? ["places"] : [],
  };
}

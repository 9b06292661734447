// Directions for the person who carries the camera: an arrow, what to do now, and what comes next.

import { setText } from "./text.js";
import { decimal, say } from "./words.js";

const at = (id) => document.getElementById(id);

const metres = (m) => ({ n: decimal(m, 1) });
const degrees = (d) => ({ angle: `${5 * Math.max(1, Math.round(Math.abs(d) / 5))}°` });
const side = (d) => (Math.abs(d) > 150 ? "around" : d > 0 ? "left" : "right");
const vertical = (d) => (d > 0 ? "up" : "down");
const look = (d) => (d === 0 ? "" : say(`walk.look.${vertical(d)}`, degrees(d)));

// Returns the heading of the arrow in degrees to the right of up, what to do, and what comes next.
export function wordsOf(walk) {
  const tilt = look(walk.look_up_deg);
  const left = walk.way_m - walk.walk_m;
  const rest = left > 0.5 ? say("walk.then.more", metres(left)) : "";
  const next = (...parts) => parts.filter((part) => part !== "").join(", ");
  switch (walk.step) {
    case "turn": {
      const then = walk.walk_m > 0 ? say("walk.then.walk", metres(walk.walk_m)) : "";
      const turn = say(`walk.turn.${side(walk.turn_deg)}`, degrees(walk.turn_deg));
      return [-walk.turn_deg, turn, next(then, tilt)];
    }
    case "walk":
      return [-walk.turn_deg, say("walk.walk", metres(walk.walk_m)), next(rest, tilt)];
    case "look": {
      const now = say(`walk.look.now.${vertical(walk.look_up_deg)}`, degrees(walk.look_up_deg));
      return [null, now, say("walk.look.hold")];
    }
    default:
      return [null, say("walk.hold"), say("walk.hold.then")];
  }
}

export function showWalk(walk) {
  const card = at("walk");
  card.hidden = walk === null || walk === undefined;
  document.body.toggleAttribute("data-walk", !card.hidden);
  if (card.hidden) return;
  const [heading, now, next] = wordsOf(walk);
  card.dataset.step = walk.step;
  const arrow = at("walk-arrow");
  // Up and down of the camera are drawn as such; the floor's arrow lies in perspective.
  const isLook = walk.step === "look";
  arrow.style.transform = isLook
    ? `rotate(${walk.look_up_deg > 0 ? 0 : 180}deg)`
    : `perspective(220px) rotateX(38deg) rotate(${heading ?? 0}deg)`;
  arrow.toggleAttribute("hidden", walk.step === "hold");
  setText(at("walk-do"), now);
  setText(at("walk-then"), next);
}

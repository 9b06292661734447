// Directions for the person who carries the camera: an arrow, what to do now, and what comes next.

const at = (id) => document.getElementById(id);

const metres = (m) => `${m.toFixed(1)} m`;
const degrees = (d) => `${5 * Math.max(1, Math.round(Math.abs(d) / 5))}°`;
const side = (d) => (Math.abs(d) > 150 ? "around" : d > 0 ? "left" : "right");
const look = (d) => (d === 0 ? "" : `look ${d > 0 ? "up" : "down"} ${degrees(d)}`);
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

// Returns the heading of the arrow in degrees to the right of up, what to do, and what comes next.
export function wordsOf(walk) {
  const tilt = look(walk.look_up_deg);
  const rest = walk.way_m > walk.walk_m + 0.5 ? `then ${metres(walk.way_m - walk.walk_m)} more` : "";
  const next = (...parts) => parts.filter((part) => part !== "").join(", ");
  switch (walk.step) {
    case "turn": {
      const amount = side(walk.turn_deg) === "around" ? "" : ` ${degrees(walk.turn_deg)}`;
      const then = walk.walk_m > 0 ? `then walk ${metres(walk.walk_m)}` : "";
      return [-walk.turn_deg, `Turn ${side(walk.turn_deg)}${amount}`, next(then, tilt)];
    }
    case "walk":
      return [-walk.turn_deg, `Walk ${metres(walk.walk_m)}`, next(rest, tilt)];
    case "look":
      return [null, capital(tilt), "hold the camera there"];
    default:
      return [null, "Hold still", "the camera looks"];
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
  if (at("walk-do").textContent !== now) at("walk-do").textContent = now;
  if (at("walk-then").textContent !== next) at("walk-then").textContent = next;
}

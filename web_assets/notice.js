// What the page says over the scene.

// state: of the navigator, null without one; shown: word of the page's state; notDelivered: why a
// command was not delivered; mayJudge: whether this page has control. Returns title and text.
export function notice(state, shown, notDelivered, mayJudge) {
  if (notDelivered !== null) return ["Command not delivered", notDelivered];
  if (state === null) return ["", ""];
  if (state.link === "stalled") {
    return ["The console does not respond", "The display is out of date. Stop still works. Restart the console with: ippon console"];
  }
  if (state.link === "silent") {
    return ["No data from the navigator", `Last message ${Math.round(state.silent_s)} s ago`];
  }
  if (state.warning) return ["Different versions", state.warning];
  switch (shown) {
    case "stopped":
      return ["Stopped", "The robot does not move until you press Resume."];
    case "found":
      return found(state, mayJudge);
    case "manual":
      return state.drive?.waypoint ? ["Driving to the point that you clicked", ""] : ["", ""];
    case "exhausted":
      return [
        "Not found",
        "The robot has searched everything that it can reach. The Search tab lists the most likely places.",
      ];
    case "lost":
      return ["The robot is waiting", state.why];
    case "ended":
      return ["The replay has ended", state.why];
    case "paused":
      return ["Paused", state.why];
    default:
      return ["", ""];
  }
}

function found(state, mayJudge) {
  const judge = mayJudge ? "Confirm or reject it in the Search tab." : "";
  if (state.out_of_reach_m === null) return [`Found: ${state.object}`, judge];
  const away = `${state.out_of_reach_m.toFixed(1)} m from the nearest place where the robot can stand`;
  return [`Found, out of reach: ${state.object}`, `It is ${away}. ${judge}`];
}

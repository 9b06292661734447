// The list of all robots on the router: state, what each searches, link; a click opens its page.

import { BASE } from "./base.js";
import { make, replaceRows, words } from "./side.js";
import { say, sayCount } from "./words.js";

const EVERY_MS = 2000;
const at = (id) => document.getElementById(id);

export class Robots {
  // sides: the panels; nameOf: returns the words for a state.
  constructor(sides, nameOf) {
    this.nameOf = nameOf;
    this.rows = new Map();
    this.isOpen = false;
    this.isFetching = false;
    sides.add("robots", "KeyB", (open) => {
      this.isOpen = open;
      this.fetch();
    });
    setInterval(() => this.fetch(), EVERY_MS);
  }

  async fetch() {
    if (!this.isOpen || document.hidden || this.isFetching) return;
    this.isFetching = true;
    try {
      const shown = await (await fetch("/api/robots")).json();
      this.show(shown.robots ?? [], shown.problem ?? "");
    } catch {
      // The page says elsewhere that the console does not respond.
    } finally {
      this.isFetching = false;
    }
  }

  show(robots, problem) {
    const before = this.rows;
    this.rows = new Map();
    for (const robot of robots) {
      const row = before.get(robot.name) ?? this.makeRow(robot);
      this.update(row, robot);
      this.rows.set(robot.name, row);
    }
    replaceRows(at("robots-list"), [...this.rows.values()].map((row) => row.node));
    const count = sayCount("robots.count", robots.length);
    at("robots-count").textContent = problem || (robots.length ? count : say("robots.none"));
  }

  makeRow(robot) {
    const node = make("li", "entry");
    const link = make("a", "robot-link");
    const [state, told, quality] = [make("small", "robot-state"), make("small"), make("small")];
    const name = make("b", "", robot.name);
    const line = make("span", "robot-line");
    line.append(name, state);
    link.append(line, told, quality);
    node.append(link);
    return { node, link, state, told, quality };
  }

  update(row, robot) {
    row.link.href = robot.path;
    if (robot.path === BASE) row.link.setAttribute("aria-current", "page");
    row.node.dataset.link = robot.link;
    row.state.textContent = robot.state && robot.link !== "gone" ? this.nameOf(robot.state) : "";
    const parts = [
      robot.object && say("robots.object", { object: words(robot.object) }),
      robot.waiting > 0 && say("robots.waiting", { n: robot.waiting }),
      robot.holder && say("robots.holder", { name: robot.holder }),
    ].filter(Boolean);
    row.told.textContent = parts.join(" · ") || robot.why;
    const heard = robot.link === "live" || robot.link === "twice"
      ? say("robots.answers", { n: Math.max(1, Math.round(robot.round_trip_ms)) })
      : say("robots.heard", { n: Math.round(robot.seen_s) });
    row.quality.textContent = [robot.link !== "live" && say(`robots.${robot.link}`), heard].filter(Boolean).join(" · ");
  }
}

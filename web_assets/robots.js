// The list of all robots on the router: state, what each searches, link; a click opens its page.
// A goal in plain words goes to the nearest free one, and each row says why it is not that one.

import { BASE, get } from "./base.js";
import { make, replaceRows } from "./side.js";
import { setText } from "./text.js";
import { nameOf, say, sayCount } from "./words.js";

const EVERY_MS = 2000;
const GIVE_MS = 90000; // Longer than the console waits for its turn, the reading and all robots.
const at = (id) => document.getElementById(id);

export class Robots {
  // sides: the panels; nameOf: returns the words for a state.
  constructor(sides, nameOf) {
    this.nameOf = nameOf;
    this.rows = new Map();
    this.isOpen = false;
    this.isFetching = false;
    this.reasons = new Map();
    this.doubtful = "";
    at("robots-give").addEventListener("submit", (event) => {
      event.preventDefault();
      this.give();
    });
    at("robots-goal").addEventListener("input", () => {
      this.forget();
      if (this.doubtful && at("robots-goal").value !== this.doubtful) this.answer("");
    });
    sides.add("robots", "KeyB", (open) => {
      this.isOpen = open;
      if (!open) this.forget();
      this.fetch();
    });
    setInterval(() => this.fetch(), EVERY_MS);
  }

  // Gives the goal that was typed; a doubtful reading is given when the same text is sent again.
  async give() {
    const send = at("robots-send");
    const sentence = at("robots-goal").value;
    if (send.disabled || !sentence.trim()) return;
    const sure = sentence === this.doubtful;
    send.disabled = true;
    this.forget();
    this.answer(say("robots.give.asking"));
    try {
      const body = JSON.stringify({ sentence, sure });
      const signal = AbortSignal.timeout(GIVE_MS);
      const reply = await fetch("/api/robots/give", { method: "POST", body, signal });
      const given = reply.ok
        ? await reply.json()
        : { ok: false, text: (await reply.text()).trim(), others: [] };
      this.told(given, sentence);
    } catch {
      this.answer(say("robots.give.failed"), false);
    } finally {
      send.disabled = false;
    }
  }

  told(given, sentence) {
    this.reasons = new Map(given.others.map((one) => [one.name, one.why]));
    this.answer(given.text, given.ok);
    this.doubtful = given.doubtful ? sentence : "";
    // Who types the next one meanwhile goes on.
    if (given.ok && at("robots-goal").value === sentence) at("robots-goal").value = "";
    if (given.robot) this.reasons.set(given.robot, say("robots.give.got"));
    for (const [name, row] of this.rows) row.why.textContent = this.reasons.get(name) ?? "";
    this.rows.get(given.robot)?.node.scrollIntoView({ block: "nearest" });
    this.fetch();
  }

  // What the robots said is not true for long.
  forget() {
    this.reasons = new Map();
    for (const row of this.rows.values()) row.why.textContent = "";
  }

  answer(text, ok = true) {
    this.doubtful = "";
    at("robots-answer").textContent = text;
    at("robots-answer").dataset.ok = String(ok);
  }

  async fetch() {
    if (!this.isOpen || document.hidden || this.isFetching) return;
    this.isFetching = true;
    try {
      const shown = await (await get("/api/robots")).json();
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
    setText(at("robots-count"), problem || (robots.length ? count : say("robots.none")));
  }

  makeRow(robot) {
    const node = make("li", "entry");
    const link = make("a", "robot-link");
    const [state, told, why, quality] = [
      make("small", "robot-state"), make("small"), make("small", "robot-why"), make("small"),
    ];
    const name = make("b", "", robot.name);
    const line = make("span", "robot-line");
    line.append(name, state);
    link.append(line, told, why, quality);
    node.append(link);
    return { node, link, state, told, why, quality };
  }

  update(row, robot) {
    row.link.href = robot.path;
    if (robot.path === BASE) row.link.setAttribute("aria-current", "page");
    row.node.dataset.link = robot.link;
    row.state.textContent = robot.state && robot.link !== "gone" ? this.nameOf(robot.state) : "";
    const parts = [
      robot.object && say("robots.object", { object: nameOf(robot.object) }),
      robot.waiting > 0 && say("robots.waiting", { n: robot.waiting }),
      robot.holder && say("robots.holder", { name: robot.holder }),
    ].filter(Boolean);
    row.told.textContent = parts.join(" · ") || robot.why;
    const heard = robot.link === "live" || robot.link === "twice"
      ? say("robots.answers", { n: Math.max(1, Math.round(robot.round_trip_ms)) })
      : say("robots.heard", { n: Math.round(robot.seen_s) });
    row.why.textContent = this.reasons.get(robot.name) ?? "";
    row.quality.textContent = [robot.link !== "live" && say(`robots.${robot.link}`), heard].filter(Boolean).join(" · ");
  }
}

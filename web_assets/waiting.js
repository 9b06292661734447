// Names the robots that do answer on the router, while the robot of this page does not.

import { get } from "./base.js";
import { make } from "./side.js";
import { say } from "./words.js";

const EVERY_MS = 3000;
const MOST = 12;
const at = (id) => document.getElementById(id);

export class Waiting {
  constructor() {
    this.isShown = this.isFetching = false;
    this.links = "";
    setInterval(() => this.fetch(), EVERY_MS);
  }

  update(isShown) {
    if (isShown === this.isShown) return;
    this.isShown = isShown;
    this.show([]);
    this.fetch();
  }

  async fetch() {
    if (!this.isShown || this.isFetching || document.hidden) return;
    this.isFetching = true;
    try {
      const { robots } = await (await get("/api/robots")).json();
      const live = (robots ?? []).filter((robot) => robot.link === "live");
      if (this.isShown) this.show(live);
    } catch {
      // The list is a help; without it the page goes on waiting.
    } finally {
      this.isFetching = false;
    }
  }

  show(robots) {
    const now = JSON.stringify(robots.map(({ name, path }) => [name, path]));
    if (now === this.links) return;
    this.links = now;
    const links = robots.slice(0, MOST).map((robot) => {
      const link = make("a", "", robot.name);
      link.href = robot.path;
      return link;
    });
    const before = links.length > 0 ? [say("veil.others")] : [];
    at("veil-robots").replaceChildren(...before, ...links);
  }
}

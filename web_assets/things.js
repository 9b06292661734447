// The list of what the robot remembers: find, show, search for.

import { button, make, replaceRows, words } from "./side.js";

const EVERY_MS = 4000;
const MINUTE_S = 60;
const at = (id) => document.getElementById(id);
const percent = (share) => `${Math.round(100 * share)} %`;

function age(nanoseconds, nowMs) {
  const seconds = Math.max(0, (nowMs - nanoseconds / 1e6) / 1000);
  if (seconds < MINUTE_S) return "just now";
  const units = [["min", MINUTE_S, 60], ["h", 3600, 48], ["days", 86400, Infinity]];
  const [unit, size] = units.find(([, size, most]) => seconds / size < most);
  return `${Math.floor(seconds / size)} ${unit} ago`;
}

export class Things {
  // sides: the panels; show: shows a place; search: sends an object to search for and returns the
  // reply.
  constructor(sides, show, search) {
    this.showPlace = show;
    this.search = search;
    this.rows = new Map();
    this.isOpen = false;
    this.isFetching = false;
    at("things-find").addEventListener("input", () => this.filter());
    sides.add("things", "KeyT", (open) => {
      this.isOpen = open;
      this.fetch();
    });
    setInterval(() => this.fetch(), EVERY_MS);
  }

  async fetch() {
    if (!this.isOpen || document.hidden || this.isFetching) return;
    this.isFetching = true;
    try {
      const reply = await (await fetch("/api/things")).json();
      this.show(reply.things ?? [], reply.problem ?? reply.note ?? "");
    } catch {
      // The page says elsewhere that the console does not respond.
    } finally {
      this.isFetching = false;
    }
  }

  // Rows keep their place while they stay what they are, so that a list of thousands is not rebuilt.
  show(things, note) {
    const newest = Math.max(Date.now(), ...things.map((thing) => thing.last_seen_ns / 1e6));
    const before = this.rows;
    this.rows = new Map();
    for (const thing of things) {
      const old = before.get(thing.instance_id);
      const key = JSON.stringify([thing.label, thing.room, thing.has_picture, thing.alternatives]);
      const row = old?.key === key ? old : this.makeRow(thing, key);
      row.thing = thing;
      row.state.textContent = this.stateOf(thing, newest);
      row.share.textContent = ` ${percent(thing.probability)}`;
      this.rows.set(thing.instance_id, row);
    }
    replaceRows(at("things-list"), [...this.rows.values()].map((row) => row.node));
    this.note = note;
    this.filter();
  }

  stateOf(thing, newest) {
    const parts = [thing.room && words(thing.room)];
    if (thing.gone_ns > 0) parts.push(`gone since ${age(thing.gone_ns, newest)}`);
    else parts.push(`seen ${age(thing.last_seen_ns, newest)}`);
    return parts.filter(Boolean).join(" · ");
  }

  makeRow(thing, key) {
    const node = make("li");
    const show = make("button", "thing");
    const picture = make("span", "crop");
    const state = make("small");
    const told = make("span", "told");
    show.type = "button";
    if (thing.has_picture) {
      const image = make("img");
      image.alt = "";
      image.loading = "lazy";
      image.src = `/api/things/${thing.instance_id}`;
      image.onerror = () => image.remove();
      picture.append(image);
    }
    const name = make("b", "", words(thing.label));
    const share = make("small");
    name.append(share);
    told.append(name, state);
    const others = thing.alternatives
      .filter(([label]) => label !== thing.label)
      .map(([label, share]) => `${words(label)} ${percent(share)}`);
    if (others.length > 0) told.append(make("small", "", `or ${others.slice(0, 2).join(", ")}`));
    show.append(picture, told);
    show.title = "Show where it is";
    const row = { key, node, state, share, thing };
    show.addEventListener("click", () => this.choose(row));
    const search = button("Search", `Search for this ${words(thing.label)}`, () => this.searchFor(row.thing));
    node.append(show, search);
    row.text = `${words(thing.label)} ${words(thing.room)} ${others.join(" ")}`.toLowerCase();
    return row;
  }

  choose(row) {
    for (const other of this.rows.values()) other.node.classList.toggle("chosen", other === row);
    this.showPlace(row.thing.position_world);
  }

  async searchFor(thing) {
    at("things-count").textContent = "…";
    const reply = await this.search(words(thing.label));
    at("things-count").textContent = reply?.text ?? "The console does not respond.";
  }

  filter() {
    const wanted = at("things-find").value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const row of this.rows.values()) {
      const fits = wanted.every((word) => row.text.includes(word));
      row.node.hidden = !fits;
      shown += fits;
    }
    const all = this.rows.size;
    const count = wanted.length ? `${shown} of ${all} things` : `${all} things`;
    const none = "Nothing is remembered yet: things are listed when they were seen well.";
    at("things-count").textContent = this.note || (all === 0 ? none : count);
  }
}

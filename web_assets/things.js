// The list of what the robot remembers, beside the plan: find, show on the plan, search for.

const EVERY_MS = 4000;
const MINUTE_S = 60;
const at = (id) => document.getElementById(id);
const words = (label) => label.replaceAll("_", " ");
const percent = (share) => `${Math.round(100 * share)} %`;

const make = (tag, name, text) => {
  const node = document.createElement(tag);
  if (name) node.className = name;
  if (text !== undefined) node.textContent = text;
  return node;
};

function age(nanoseconds, nowMs) {
  const seconds = Math.max(0, (nowMs - nanoseconds / 1e6) / 1000);
  if (seconds < MINUTE_S) return "just now";
  const units = [["min", MINUTE_S, 60], ["h", 3600, 48], ["days", 86400, Infinity]];
  const [unit, size] = units.find(([, size, most]) => seconds / size < most);
  return `${Math.floor(seconds / size)} ${unit} ago`;
}

export class Things {
  // plan: where a thing is shown; search: sends an object to search for and returns the reply.
  constructor(plan, search) {
    this.plan = plan;
    this.search = search;
    this.rows = new Map();
    this.chosen = null;
    this.isFetching = false;
    plan.openThings = () => this.toggle();
    at("things-open").addEventListener("click", plan.openThings);
    at("things-find").addEventListener("input", () => this.filter());
    at("things-find").addEventListener("keydown", (event) => {
      event.stopPropagation();
      if (event.key === "Escape") this.toggle();
    });
    setInterval(() => this.fetch(), EVERY_MS);
  }

  get isOpen() {
    return !at("things").hidden && this.plan.size === "full";
  }

  toggle() {
    const open = !this.isOpen;
    if (this.plan.size !== "full") this.plan.resize("full");
    at("things").hidden = !open;
    at("things-open").setAttribute("aria-pressed", String(open));
    if (open) {
      at("things-find").focus();
    } else {
      this.plan.pointed = null;
      // A hidden field would take the next key for itself.
      this.plan.canvas.focus({ preventScroll: true });
    }
    this.fetch();
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
    const list = at("things-list");
    const wanted = [...this.rows.values()].map((row) => row.node);
    const isSame = wanted.length === list.childElementCount
      && wanted.every((node, n) => node === list.children[n]);
    if (!isSame) list.replaceChildren(...wanted);
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
    show.title = "Show it on the plan";
    const row = { key, node, state, share, thing };
    show.addEventListener("click", () => this.choose(row));
    const search = make("button", "search-for", "Search");
    search.type = "button";
    search.setAttribute("aria-label", `Search for this ${words(thing.label)}`);
    search.addEventListener("click", () => this.searchFor(row.thing));
    node.append(show, search);
    row.text = `${words(thing.label)} ${words(thing.room)} ${others.join(" ")}`.toLowerCase();
    return row;
  }

  choose(row) {
    const [x, y] = row.thing.position_world;
    for (const other of this.rows.values()) other.node.classList.toggle("chosen", other === row);
    this.plan.point([x, y]);
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

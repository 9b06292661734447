// The list of what the robot remembers: find, show, search for, name, and say what it is not.

import { BASE, get } from "./base.js";
import { button, make, replaceRows } from "./side.js";
import { setText } from "./text.js";
import { LANGUAGE, nameOf, percent, roomOf, say } from "./words.js";

const EVERY_MS = 4000;
const MINUTE_S = 60;
const TOLD_MS = 8000;
const CHUNK = 60;
const AHEAD_PX = 900;
const at = (id) => document.getElementById(id);
const plain = (label) => label.replaceAll("_", " ");
const titleOf = (thing) => thing.name || nameOf(thing.label) || say("things.unknown");

function othersOf(thing) {
  return thing.alternatives
    .filter(([label]) => label !== thing.label)
    .map(([label, share]) => `${nameOf(label)} ${percent(share)}`);
}

function textOf(thing) {
  const labels = [thing.label, thing.room];
  const names = [nameOf(thing.label), roomOf(thing.room)];
  const parts = [titleOf(thing), ...names, ...labels.map(plain), ...othersOf(thing)];
  return parts.join(" ").toLowerCase();
}

function sureness({ name, label, probability }) {
  return label && !name ? ` ${percent(probability)}` : "";
}

// With its article in English; other languages have the bare word, whose gender is not known.
function a(label, article = "a") {
  if (LANGUAGE !== "en") return nameOf(label);
  return `${article}${/^[aeiou]/.test(label) ? "n" : ""} ${nameOf(label)}`;
}

function age(nanoseconds, nowMs) {
  const seconds = Math.max(0, (nowMs - nanoseconds / 1e6) / 1000);
  if (seconds < MINUTE_S) return say("things.age.now");
  const units = [["minutes", MINUTE_S, 60], ["hours", 3600, 48], ["days", 86400, Infinity]];
  const [unit, size] = units.find(([, size, most]) => seconds / size < most);
  return say(`things.age.${unit}`, { n: Math.floor(seconds / size) });
}

export class Things {
  // sides: the panels; show: shows a place with the size, the title and the probability of what is
  // there; request: sends a message and returns the reply.
  constructor(sides, show, request) {
    this.showPlace = show;
    this.request = request;
    this.rows = new Map();
    this.isOpen = false;
    this.isFetching = false;
    this.asked = this.answered = 0;
    this.chosen = null;
    this.told = this.problem = "";
    this.shown = CHUNK;
    this.list = at("things-list");
    at("things-find").addEventListener("input", () => {
      this.shown = CHUNK;
      this.list.scrollTop = 0;
      this.filter();
    });
    this.list.addEventListener("scroll", () => this.showMore(), { passive: true });
    sides.add("things", "KeyT", (open) => {
      this.isOpen = open;
      this.fetch();
    });
    setInterval(() => this.fetch(), EVERY_MS);
  }

  // always: although an answer is under way, which may be older than what was just changed.
  async fetch(always = false) {
    if (!this.isOpen || document.hidden || (this.isFetching && !always)) return;
    this.isFetching = true;
    this.asked += 1;
    const number = this.asked;
    try {
      const answer = await get(`${BASE}api/things`);
      const reply = await answer.json();
      if (number < this.answered) return;
      this.answered = number;
      this.show(reply.things ?? [], reply.problem ?? reply.note ?? "", answer.headers.get("date"));
    } catch {
      // The page says elsewhere that the console does not respond.
    } finally {
      this.isFetching = false;
    }
  }

  // Rows keep their place while they stay what they are, so that a list of thousands is not rebuilt.
  // date: of the answer. The clock of a tablet may be wrong by hours.
  show(things, note, date) {
    this.newest = things.reduce((last, one) => Math.max(last, one.last_seen_ns / 1e6), Date.parse(date));
    const before = this.rows;
    this.rows = new Map();
    for (const thing of things) {
      const old = before.get(thing.instance_id);
      const key = JSON.stringify([
        thing.label, thing.name, thing.denied, thing.room, thing.has_picture, thing.alternatives,
        thing.first_seen_ns,
      ]);
      const isSame = old !== undefined && (old.key === key || old.isEdited);
      const row = isSame ? old : { key, node: null, text: textOf(thing), isEdited: false };
      row.thing = thing;
      this.rows.set(thing.instance_id, row);
    }
    this.problem = note;
    this.filter();
  }

  stateOf(thing, newest) {
    const kind = thing.name && thing.label && `${nameOf(thing.label)} ${percent(thing.probability)}`;
    const parts = [kind, thing.room && roomOf(thing.room)];
    if (thing.gone_ns > 0) parts.push(say("things.gone", { age: age(thing.gone_ns, newest) }));
    else parts.push(say("things.seen", { age: age(thing.last_seen_ns, newest) }));
    return parts.filter(Boolean).join(" · ");
  }

  // Gives a row that is in view its node, and says how the thing is now.
  draw(row) {
    if (row.node === null) {
      this.build(row);
      if (this.chosen === row.thing.instance_id) this.mark(row);
    }
    row.state.textContent = this.stateOf(row.thing, this.newest);
    row.share.textContent = sureness(row.thing);
    return row.node;
  }

  build(row) {
    const { thing } = row;
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
      // A navigator that was started again numbers other things from 1, and browsers keep pictures.
      image.src = `${BASE}api/things/${thing.instance_id}?since=${thing.first_seen_ns}`;
      image.onerror = () => image.remove();
      picture.append(image);
    }
    const name = make("b", "", titleOf(thing));
    const share = make("small");
    name.append(share);
    told.append(name, state);
    const others = othersOf(thing);
    if (others.length > 0) {
      told.append(make("small", "", say("things.or", { others: others.slice(0, 2).join(", ") })));
    }
    if (thing.denied.length > 0) {
      told.append(make("small", "", thing.denied.map((label) => say("things.not", { label: a(label) })).join(", ")));
    }
    show.append(picture, told);
    show.title = say("things.show.hint");
    node.dataset.row = thing.instance_id;
    Object.assign(row, { node, state, share });
    show.addEventListener("click", () => this.choose(row));
    node.append(show);
    if (thing.label || thing.name) {
      const label = say("things.search.hint", { thing: titleOf(thing) });
      node.append(button(say("things.search"), label, () => this.searchFor(row.thing)));
    }
  }

  choose(row) {
    const before = this.rows.get(this.chosen);
    if (before?.node && before !== row) {
      before.node.classList.remove("chosen");
      before.node.querySelector(".acts")?.remove();
      this.endEdit(before);
    }
    this.mark(row);
    const { position_world, size_m, label, probability } = row.thing;
    this.showPlace(position_world, size_m, titleOf(row.thing), label ? probability : null);
  }

  // Only the chosen row has the buttons that are seldom needed: a list of thousands stays light.
  mark(row) {
    this.chosen = row.thing.instance_id;
    row.node.classList.add("chosen");
    if (row.node.querySelector(".acts")) return;
    const { label, name, denied } = row.thing;
    const title = titleOf(row.thing);
    const acts = make("span", "acts");
    const note = (text, words, change) => button(text, words, () => this.note(row, change));
    acts.append(button(say(name ? "things.rename" : "things.name"), say("things.name.hint", { thing: title }), () => this.edit(row)));
    if (label) {
      const hint = say("things.deny.hint", { thing: title, label: a(label) });
      acts.append(note(say("things.deny", { label: a(label) }), hint, { deny: label }));
    }
    for (const other of denied) {
      const hint = say("things.allow.hint", { thing: title, label: a(other) });
      acts.append(note(say("things.allow", { label: a(other, "A") }), hint, { allow: other }));
    }
    row.node.append(acts);
  }

  edit(row) {
    if (row.isEdited) return;
    const form = make("form", "edit");
    const field = make("input");
    field.value = row.thing.name;
    field.maxLength = 40;
    field.placeholder = say("things.name.example");
    field.setAttribute("aria-label", say("things.name.field"));
    const stop = button(say("things.back"), say("things.back.hint"), () => this.endEdit(row));
    form.append(field, make("button", "", say("things.save")), stop);
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      await this.note(row, { name: field.value.trim() });
    });
    form.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      this.endEdit(row);
    });
    row.isEdited = true;
    row.node.dataset.edited = "";
    row.node.append(form);
    field.focus();
    field.select();
  }

  endEdit(row) {
    if (!row.isEdited) return;
    row.isEdited = false;
    row.node.querySelector("form")?.remove();
    delete row.node.dataset.edited;
    row.node.querySelector(".acts button")?.focus();
  }

  // Rows beyond what is in view get their nodes as the list is scrolled.
  render() {
    replaceRows(this.list, this.fits.slice(0, this.shown).map((row) => this.draw(row)));
  }

  showMore() {
    const below = this.list.scrollHeight - this.list.scrollTop - this.list.clientHeight;
    if (below > AHEAD_PX || this.shown >= this.fits.length) return;
    this.shown += CHUNK;
    const more = this.fits.slice(this.list.childElementCount, this.shown);
    this.list.append(...more.map((row) => this.draw(row)));
  }

  async note(row, change) {
    const message = { type: "note", change: { instance_id: row.thing.instance_id, ...change } };
    const reply = await this.ask(message);
    if (reply?.ok) {
      this.endEdit(row);
      await this.fetch(true);
      // Who types meanwhile, the next name or what to find, goes on where they are.
      if (document.activeElement?.tagName === "INPUT") return reply;
      this.rows.get(this.chosen)?.node?.querySelector(".acts button")?.focus();
    }
    return reply;
  }

  async searchFor(thing) {
    await this.ask({ type: "search", object: thing.name || plain(thing.label) });
  }

  // Sends a message; its answer is shown for a while in place of the number of things.
  async ask(message) {
    this.tell("…");
    const reply = await this.request(message);
    this.tell(reply?.text ?? say("link.silence.sentence"));
    return reply;
  }

  tell(text) {
    this.told = text;
    clearTimeout(this.untell);
    this.untell = setTimeout(() => {
      this.told = "";
      this.filter();
    }, TOLD_MS);
    this.filter();
  }

  filter() {
    const wanted = at("things-find").value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    this.fits = [...this.rows.values()].filter((row) => wanted.every((word) => row.text.includes(word)));
    this.render();
    const all = this.rows.size;
    const count = wanted.length
      ? say("things.count.some", { fit: this.fits.length, all })
      : say("things.count", { n: all });
    const none = say("things.none");
    setText(at("things-count"), this.told || this.problem || (all === 0 ? none : count));
  }
}

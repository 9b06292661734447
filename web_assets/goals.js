// The goals: what is searched for, what waits in which order, what has ended, and saved searches.

import { BASE, get } from "./base.js";
import { button, make, replaceRows } from "./side.js";
import { has, nameOf, say, sayCount } from "./words.js";

const at = (id) => document.getElementById(id);
const SECTIONS = ["active", "waiting", "ended", "saved"];

// What the requester typed, which is sent back, too; a label is shown by its name.
const typed = (goal) => goal.display || goal.object.replaceAll("_", " ");

export function clock(seconds) {
  const whole = Math.max(0, Math.floor(seconds));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

const isFound = (goal) => goal.outcome === "found" || goal.outcome === "out_of_reach";

// Nothing of it goes on, and no find waits for a verdict. In a tour such a goal stays among those that are
// searched for until all are over.
const isOver = (goal) => goal.outcome !== "active" && (goal.confirmed || !isFound(goal));

// The outcome, and whether a find still waits for a verdict.
function judged(goal, outcome, section) {
  if (goal.confirmed) return say("goals.confirmed", { outcome });
  if (!isFound(goal)) return outcome;
  return say(section === "active" ? "goals.judge" : "goals.unconfirmed", { outcome });
}

function stateOf(goal, section) {
  const known = `goals.outcome.${goal.outcome}`;
  const outcome = has(known) ? say(known) : goal.outcome;
  const parts = [judged(goal, outcome, section)];
  if (goal.count !== 1) {
    const found = goal.counted.length + (isFound(goal) ? 1 : 0);
    parts.push(say(goal.count === "all" ? "goals.count.all" : "goals.count.some", { found, count: goal.count }));
  }
  if (goal.rejected) parts.push(sayCount("goals.rejected", goal.rejected));
  if (goal.took_s !== null) parts.push(clock(goal.took_s));
  if (goal.tour) parts.push(say("goals.tour"));
  return parts.join(" · ");
}

export class Goals {
  // sides: the panels; send: sends a message and returns the reply; mayChange: whether this page
  // commands the robot; show: flies to a place.
  constructor(sides, send, mayChange, show) {
    this.send = send;
    this.mayChange = mayChange;
    this.showPlace = show;
    this.rows = new Map();
    this.lists = { active: [], waiting: [], ended: [], saved: [] };
    this.known = null;
    this.isOpen = false;
    sides.add("goals", "KeyG", (open) => {
      this.isOpen = open;
      this.known = null;
      at("goals-answer").textContent = "";
      this.fetch(this.wanted);
    });
  }

  // state: of the page, with the checksum of the goals.
  update(state) {
    const waiting = state?.waiting ?? 0;
    for (const badge of document.querySelectorAll(".goals-waiting")) {
      badge.textContent = waiting > 0 ? String(waiting) : "";
    }
    this.wanted = state?.goals ?? null;
    const may = this.mayChange();
    at("goals").toggleAttribute("data-watching", !may);
    for (const one of at("goals").querySelectorAll("button[data-changes]")) one.disabled = !may;
    this.fetch(this.wanted);
  }

  async fetch(wanted) {
    if (!this.isOpen || this.isFetching || wanted === this.known) return;
    this.isFetching = true;
    try {
      const lists = await (await get(`${BASE}api/goals`)).json();
      this.known = wanted;
      this.render(lists);
    } catch {
      // The page says elsewhere that the console does not respond.
    } finally {
      this.isFetching = false;
    }
  }

  render(lists) {
    this.lists = {
      active: lists.active ?? [],
      waiting: lists.waiting ?? [],
      ended: lists.ended ?? [],
      saved: lists.saved?.searches ?? [],
    };
    const before = this.rows;
    this.rows = new Map();
    for (const section of SECTIONS) {
      const nodes = this.lists[section].map((goal, place) => {
        const id = `${section} ${goal.goal_id ?? goal.saved_id}`;
        const key = JSON.stringify([goal, this.neighbours(section, place)]);
        const old = before.get(id);
        // A row that is being edited stays as it is.
        const row = old && (old.key === key || old.isEdited) ? old : this.makeRow(section, goal, place, key);
        this.rows.set(id, row);
        if (section === "waiting") row.number.textContent = `${place + 1}.`;
        return row.node;
      });
      // What somebody is typing stays until it is saved or closed, also when its goal has moved on.
      for (const [id, row] of before) {
        if (!row.isEdited || this.rows.has(id) || !id.startsWith(`${section} `)) continue;
        this.rows.set(id, row);
        nodes.push(row.node);
      }
      replaceRows(at(`goals-${section}`), nodes);
      at(`goals-${section}`).parentElement.hidden = nodes.length === 0;
    }
    const none = SECTIONS.every((section) => this.lists[section].length === 0);
    at("goals-none").hidden = !none;
    at("goals-note").textContent = lists.saved?.note ?? "";
    const may = this.mayChange();
    for (const one of at("goals").querySelectorAll("button[data-changes]")) one.disabled = !may;
  }

  // Numbers of the goals before which a waiting one is moved up or down, with its tour.
  neighbours(section, place) {
    if (section !== "waiting") return {};
    const waiting = this.lists.waiting;
    const tourOf = (goal) => goal.tour ?? goal.goal_id;
    const tours = [...new Set(waiting.map(tourOf))];
    const mine = tours.indexOf(tourOf(waiting[place]));
    const first = (tour) => waiting.find((goal) => tourOf(goal) === tour)?.goal_id;
    return { above: first(tours[mine - 1]), below: first(tours[mine + 1]) };
  }

  makeRow(section, goal, place, key) {
    const node = make("li", "entry");
    const number = make("span", "number");
    const told = make("span", "told");
    const acts = make("span", "acts");
    const name = nameOf(typed(goal));
    told.append(make("b", "", name));
    if (goal.context) told.append(make("small", "context", goal.context));
    if (section !== "saved") told.append(make("small", "", stateOf(goal, section)));
    else if (goal.count !== 1) {
      const kind = goal.count === "all" ? "all" : "some";
      told.append(make("small", "", say(`goals.saved.${kind}`, { count: goal.count })));
    }
    node.dataset.outcome = goal.outcome ?? "saved";
    node.dataset.row = goal.goal_id ?? goal.saved_id;
    const row = { key, node, number, isEdited: false };
    acts.append(...this.buttons(section, goal, name, place, row));
    node.append(number, told, acts);
    return row;
  }

  buttons(section, goal, name, place, row) {
    const change = (text, label, message) => {
      const node = button(text, label, () => this.ask(message));
      node.dataset.changes = "";
      return node;
    };
    const queue = (action, more = {}) => ({
      type: "queue", change: { goal_id: goal.goal_id, action, ...more },
    });
    const { goal_id, saved_id, context } = goal;
    const save = () => change(say("goals.save"), say("goals.save.hint", { name }), {
      type: "saved", change: { action: "save", object: typed(goal), context: context ?? "", goal_id },
    });
    const found = [];
    if (goal.position_world) {
      const label = say("goals.show.hint", { name });
      found.push(button(say("goals.show"), label, () => this.showPlace(goal.position_world)));
    }
    if (section === "active") {
      if (isOver(goal)) return [...found, save()];
      const cancel = { type: "control", action: "cancel", goal_id };
      return [...found, change(say("goals.cancel"), say("goals.cancel.active.hint", { name }), cancel), save()];
    }
    if (section === "ended") {
      const repeat = change(say("goals.repeat"), say("goals.repeat.hint", { name }), queue("repeat"));
      return [...found, repeat, save()];
    }
    if (section === "saved") {
      return [
        change(say("goals.run"), say("goals.run.hint", { name }), {
          type: "saved", change: { action: "run", saved_id },
        }),
        change(say("goals.delete"), say("goals.delete.hint", { name }), {
          type: "saved", change: { action: "delete", saved_id },
        }),
      ];
    }
    const { above, below } = this.neighbours(section, place);
    const up = change("↑", say("goals.up.hint", { name }), queue("before", { before: above }));
    const down = change("↓", say("goals.down.hint", { name }), {
      type: "queue", change: { goal_id: below, action: "before", before: goal_id },
    });
    if (above === undefined) up.hidden = true;
    if (below === undefined) down.hidden = true;
    const edit = button(say("goals.edit"), say("goals.edit.hint", { name }), () => this.edit(row, goal));
    edit.dataset.edits = "";
    edit.dataset.changes = "";
    const cancel = change(say("goals.cancel"), say("goals.cancel.waiting.hint", { name }), queue("remove"));
    return [up, down, edit, cancel, save()];
  }

  edit(row, goal) {
    const form = make("form", "edit");
    const fields = [["object", typed(goal), 80], ["context", goal.context, 2000]].map(([part, value, most]) => {
      const label = say(`goals.edit.${part}`);
      const field = make("input");
      field.value = value;
      field.maxLength = most;
      field.setAttribute("aria-label", label);
      field.placeholder = label;
      return field;
    });
    const save = make("button", "", say("goals.save"));
    const stop = button(say("goals.back"), say("goals.back.hint"), () => this.endEdit(row));
    form.append(...fields, save, stop);
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      const [object, context] = fields.map((field) => field.value.trim());
      const reply = await this.ask({
        type: "queue", change: { goal_id: goal.goal_id, action: "edit", object, context },
      });
      if (reply?.ok) this.endEdit(row);
    });
    form.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      this.endEdit(row);
    });
    row.isEdited = true;
    row.node.append(form);
    row.node.dataset.edited = "";
    fields[0].focus();
    fields[0].select();
  }

  endEdit(row) {
    row.isEdited = false;
    row.node.querySelector("form")?.remove();
    delete row.node.dataset.edited;
    row.node.querySelector("[data-edits]")?.focus();
    this.known = null;
    this.fetch(this.wanted);
  }

  async ask(message) {
    at("goals-answer").textContent = "…";
    const reply = await this.send(message);
    // A control request is answered by a word for programs, the state that it leads to.
    const text = reply?.ok && message.type === "control" ? "" : reply?.text;
    at("goals-answer").textContent = text || say(reply ? "goals.done" : "link.silence.sentence");
    at("goals-answer").dataset.ok = String(reply?.ok ?? false);
    return reply;
  }
}

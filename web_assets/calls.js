// Calls: sounds and notifications of this browser, and what has been sent to the webhook.

import { BASE, get } from "./base.js";
import { button, make, replaceRows } from "./side.js";
import { LANGUAGE, nameOf, say } from "./words.js";

const at = (id) => document.getElementById(id);
const MUTED = "ippon-muted";
const RUNG = `ippon-rung ${BASE}`;
const WAYS = ["sound", "notification"];

const muted = () => new Set(JSON.parse(localStorage.getItem(MUTED) ?? "[]"));

// With its day, unless that is today.
function timeOf(call) {
  const date = new Date(call.wall_ns / 1e6);
  const day = date.toDateString() === new Date().toDateString() ? {} : { day: "numeric", month: "short" };
  return date.toLocaleString(LANGUAGE, { ...day, hour: "2-digit", minute: "2-digit" });
}

export class Calls {
  // sides: the panels; send: sends a message and returns the reply; mayChange: whether this page
  // commands the robot; show: flies to a place.
  constructor(sides, send, mayChange, show) {
    this.send = send;
    this.mayChange = mayChange;
    this.showPlace = show;
    this.known = null;
    this.newest = null;
    this.seen = 0;
    this.calls = [];
    this.rows = new Map();
    this.isOpen = false;
    this.audio = null;
    sides.add("calls", "KeyN", (open) => {
      this.isOpen = open;
      this.markSeen();
      this.renderTimes();
      this.renderPermission();
    });
    at("calls-allow").addEventListener("click", async () => {
      await Notification.requestPermission();
      this.renderPermission();
    });
    at("calls-try").addEventListener("click", () => this.ring(say("calls.test"), say("calls.test.text"), muted(), ""));
    this.listen(window);
  }

  // Browsers let a page make sounds after its first click or key, there or in the scene.
  listen(target) {
    for (const event of ["pointerdown", "keydown"]) {
      target.addEventListener(event, () => this.wakeAudio(), { capture: true });
    }
  }

  // state: of the page, with the checksum of the calls.
  update(state) {
    const wanted = state?.calls ?? 0;
    const instance = state?.instance ?? this.instance;
    if (this.instance && instance !== this.instance) {
      // A console that was started again counts its calls from 1: none of them has sounded.
      Object.assign(this, { known: null, newest: 0, seen: 0 });
    }
    this.instance = instance;
    this.renderControl();
    if (wanted !== 0) this.fetch(wanted);
  }

  async fetch(wanted) {
    if (this.isFetching || wanted === this.known) return;
    this.isFetching = true;
    try {
      const shown = await (await get(`${BASE}api/calls`)).json();
      this.known = wanted;
      this.take(shown);
    } catch {
      // The page says elsewhere that the console does not respond.
    } finally {
      this.isFetching = false;
    }
  }

  take(shown) {
    this.calls = shown.calls ?? [];
    const newest = this.calls[0]?.number ?? 0;
    // Calls from before this page make no sound.
    if (this.newest === null) {
      this.newest = newest;
      this.seen = newest;
    }
    const fresh = this.calls.filter((call) => call.number > this.newest);
    this.newest = newest;
    for (const call of fresh.reverse()) this.call(call);
    this.render(shown);
  }

  call(call) {
    const off = muted();
    const { kind, text } = call.occasion;
    // Of several pages of one browser, one calls.
    const [instance, number] = (localStorage.getItem(RUNG) ?? "").split(" ");
    if (instance === this.instance && Number(number) >= call.number) return;
    localStorage.setItem(RUNG, `${this.instance} ${call.number}`);
    this.ring(call.title, text, off, kind, call.number);
  }

  ring(title, text, off, kind, number = 0) {
    if (!off.has(`sound ${kind}`)) this.beep();
    if (off.has(`notification ${kind}`) || this.permission !== "granted") return;
    try {
      // One of another call, or of another robot, stays beside it.
      const tag = `ippon ${this.instance} ${number}`;
      const from = at("robot").textContent;
      const notification = new Notification(`IPPON ${from}: ${title}`, { body: text, tag });
      notification.onclick = () => window.focus();
    } catch {
      // Browsers of phones offer notifications to installed pages only.
      at("calls-permission").textContent = say("calls.unsupported");
    }
  }

  get permission() {
    return globalThis.Notification?.permission ?? "unsupported";
  }

  wakeAudio() {
    this.audio ??= globalThis.AudioContext ? new AudioContext() : null;
    if (this.audio?.state === "suspended") this.audio.resume();
  }

  beep() {
    const audio = this.audio;
    document.body.dataset.rang = String(Number(document.body.dataset.rang ?? 0) + 1);
    if (audio === null || audio.state !== "running") return;
    for (const [start, pitch] of [[0, 660], [0.18, 880]]) {
      const tone = audio.createOscillator();
      const loudness = audio.createGain();
      tone.frequency.value = pitch;
      const from = audio.currentTime + start;
      loudness.gain.setValueAtTime(0.0001, from);
      loudness.gain.exponentialRampToValueAtTime(0.25, from + 0.02);
      loudness.gain.exponentialRampToValueAtTime(0.0001, from + 0.16);
      tone.connect(loudness).connect(audio.destination);
      tone.start(from);
      tone.stop(from + 0.17);
    }
  }

  markSeen() {
    if (this.isOpen) this.seen = this.newest ?? 0;
    const unseen = this.calls.filter((call) => call.number > this.seen).length;
    for (const badge of document.querySelectorAll(".calls-unseen")) {
      badge.textContent = unseen > 0 ? String(unseen) : "";
    }
  }

  render(shown) {
    this.markSeen();
    at("calls-webhook").textContent = shown.webhook
      ? say("calls.webhook", { address: shown.webhook })
      : say("calls.nowhere");
    if (at("calls-kinds").childElementCount === 0) {
      at("calls-kinds").replaceChildren(...this.kindRows(shown.titles ?? {}));
    }
    const before = this.rows;
    this.rows = new Map();
    for (const call of this.calls) {
      const id = `${call.number} ${call.wall_ns} ${call.occasion.goal_id}`;
      const row = before.get(id) ?? this.makeRow(call);
      row.text.textContent = call.judged
        ? say(`calls.judged.${call.judged}`, { name: nameOf(call.occasion.object) })
        : call.occasion.text;
      row.webhook.textContent = call.webhook && say("calls.webhook.state", { state: call.webhook });
      row.webhook.hidden = call.webhook === "";
      this.rows.set(id, row);
    }
    replaceRows(at("calls-list"), [...this.rows.values()].map((row) => row.node));
    at("calls-none").hidden = this.calls.length > 0;
    this.renderTimes();
    this.renderControl();
  }

  renderTimes() {
    for (const { call, time } of this.rows.values()) time.textContent = ` ${timeOf(call)}`;
  }

  // Only a page that commands the robot can have it search again.
  renderControl() {
    const may = this.mayChange();
    for (const one of at("calls-list").querySelectorAll("button[data-changes]")) one.hidden = !may;
  }

  makeRow(call) {
    const node = make("li", "entry");
    const [text, webhook, time] = [make("small"), make("small"), make("small")];
    const told = make("span", "told");
    const name = make("b", "", call.title);
    name.append(time);
    told.append(name, text);
    if (call.count > 1) told.append(make("small", "", say("calls.times", { n: call.count })));
    told.append(webhook);
    node.append(told, this.acts(call.occasion));
    return { node, text, webhook, time, call };
  }

  acts({ kind, goal_id, object, position_world }) {
    const acts = make("span", "acts");
    if (position_world) {
      const hint = say("goals.show.hint", { name: nameOf(object) });
      acts.append(button(say("goals.show"), hint, () => this.showPlace(position_world)));
    }
    if (kind === "not_found" && goal_id !== null) {
      const hint = say("goals.repeat.hint", { name: nameOf(object) });
      const change = { goal_id, action: "repeat" };
      const repeat = button(say("goals.repeat"), hint, async () => {
        const reply = await this.send({ type: "queue", change });
        at("calls-answer").textContent = reply?.text || say(reply ? "goals.done" : "link.silence.sentence");
      });
      repeat.dataset.changes = "";
      acts.append(repeat);
    }
    return acts;
  }

  kindRows(titles) {
    return Object.entries(titles).map(([kind, title]) => {
      const row = make("tr");
      const head = make("th", "", title);
      head.scope = "row";
      row.append(head);
      for (const way of WAYS) {
        // Not a checkbox: Space stops the robot, and would not change one.
        const box = button("", say("calls.switch", { way: say(`calls.${way}`), kind: title }), () => {
          const off = muted();
          if (off.has(`${way} ${kind}`)) off.delete(`${way} ${kind}`);
          else off.add(`${way} ${kind}`);
          localStorage.setItem(MUTED, JSON.stringify([...off]));
          show();
        });
        const show = () => {
          const isOn = !muted().has(`${way} ${kind}`);
          box.setAttribute("aria-checked", String(isOn));
          box.textContent = say(isOn ? "calls.on" : "calls.off");
        };
        box.setAttribute("role", "switch");
        show();
        const cell = make("td");
        cell.append(box);
        row.append(cell);
      }
      return row;
    });
  }

  renderPermission() {
    at("calls-allow").hidden = this.permission !== "default";
    at("calls-permission").textContent =
      this.permission === "granted" ? "" : say(`calls.permission.${this.permission}`);
  }
}

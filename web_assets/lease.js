// Control lease: one browser commands, the others watch, and each can stop the robot.

import { BASE, get } from "./base.js";
import { setText } from "./text.js";
import { say } from "./words.js";

const BEAT_MS = 1000;
const at = (id) => document.getElementById(id);

export class Lease {
  // send: passes one message on; act: does what a button says to the one who asks for control;
  // view: the scene's frame.
  constructor(send, act, view) {
    this.act = act;
    this.view = view;
    this.you = { name: "", role: "operator", standing: "watches", detail: "", has_login: false };
    this.lease = { state: "free", holder: "", requester: "", epoch: 0 };
    this.deniedBy = null; // Who has just kept control from this page.
    // A page that the browser puts to sleep sends no beat, and its lease expires.
    setInterval(() => {
      send({ type: "alive" });
      // The panels may load long after the last lease update.
      this.disablePanels();
    }, BEAT_MS);
    for (const button of document.querySelectorAll("button[data-lease]")) {
      button.addEventListener("click", () => act(button.dataset.lease, this.asks));
    }
    at("log-out").addEventListener("click", () => this.logOut());
  }

  get holds() {
    return this.you.standing === "holds" && this.lease.state !== "free";
  }

  // Who asks for control on the page: grant and deny answer nobody else.
  get asks() {
    return at("asked").hidden ? "" : this.lease.requester;
  }

  // Why the panels are disabled on this page, "" when they are enabled.
  get watching() {
    if (this.you.role === "viewer") return say("lease.viewer");
    if (this.lease.state === "free" || this.holds) return "";
    const name = this.lease.holder;
    return say(name === this.deniedBy ? "lease.denied" : "lease.watching", { name });
  }

  meet(you) {
    this.you = you;
    this.deniedBy = you.standing === "denied" ? this.lease.holder : null;
  }

  update(lease) {
    if (lease) this.lease = lease;
    this.render();
  }

  render() {
    const { you, lease } = this;
    const isFree = lease.state === "free";
    const role = say(`role.${you.role}`);
    const mayCommand = you.role !== "viewer";
    const waits = you.standing === "waits" && !this.holds;
    at("holder").textContent = isFree ? say("lease.nobody") : this.holds ? say("lease.you") : lease.holder;
    at("holder").title = at("holder").textContent;
    at("control").dataset.lease = this.holds ? "yours" : lease.state;
    at("lease-take").hidden = !(isFree && mayCommand);
    at("lease-release").hidden = !this.holds;
    at("lease-request").hidden = isFree || this.holds || waits || !mayCommand;
    at("lease-withdraw").hidden = !waits || isFree;
    at("lease-over").hidden = isFree || this.holds || you.role !== "supervisor";
    at("you").textContent = you.has_login ? say("lease.login", { name: you.name, role }) : "";
    at("log-out").hidden = !you.has_login;
    at("log-out").title = say("lease.logout.hint", { name: you.name, role });
    at("asked").hidden = !(this.holds && lease.requester);
    setText(at("asked-text"), say("asked.text", { name: lease.requester }));
    this.disablePanels();
  }

  // Disables the panels while another browser has control, and shows the reason.
  disablePanels() {
    const panel = this.view.contentDocument?.querySelector('[data-dock-region="right"]');
    if (panel == null) return;
    if (this.watching === "") delete panel.dataset.ipWatching;
    else if (panel.dataset.ipWatching !== this.watching) panel.dataset.ipWatching = this.watching;
  }

  async logOut() {
    await fetch("/logout", { method: "POST", redirect: "manual" });
    logIn();
  }
}

// Who has logged in is on the page of the same robot again.
function logIn() {
  location.href = BASE === "/" ? "/login" : `/login?to=${encodeURIComponent(BASE)}`;
}

// A refused socket gives no reason: ask whether the login has expired.
export async function logInAgainIfAsked() {
  try {
    if ((await get("/health")).status === 401) logIn();
  } catch {
    // The console does not respond at all; the page already says so.
  }
}

// Manual driving: reads the keys and the pad and sends the operator's input. Releasing sends zero once.

import { setText } from "./text.js";
import { say } from "./words.js";

const PERIOD_MS = 50;
const NOTE_MS = 250;
const KEYS = {
  KeyW: { forward: 1 },
  KeyS: { forward: -1 },
  KeyA: { turn: 1 },
  KeyD: { turn: -1 },
  KeyQ: { forward: 1, turn: 0.5 },
  KeyE: { forward: 1, turn: -0.5 },
  KeyR: { tilt: 1 },
  KeyF: { tilt: -1 },
};
const at = (id) => document.getElementById(id);

export class Drive {
  // send: passes one message on; setMode: asks for another mode; obstacle: tells why keys move
  // nothing now, as text and as "control", "line" or "picture".
  constructor(send, setMode, obstacle) {
    this.send = send;
    this.obstacle = obstacle;
    this.drive = { mode: "auto" };
    this.mode = "auto";
    this.keys = new Set();
    this.pads = new Map();
    this.moving = false;
    setInterval(() => this.moving && this.post(), PERIOD_MS);
    setInterval(() => this.renderNote(), NOTE_MS);
    document.addEventListener("visibilitychange", () => document.hidden && this.release());
    this.listen(window);
    for (const button of document.querySelectorAll("[data-hold]")) this.adoptPad(button);
    at("pad-auto").addEventListener("click", () => setMode("auto"));
  }

  // Listens before other handlers, in this document and in that of the scene.
  listen(target) {
    target.addEventListener("keydown", (event) => this.onKey(event), true);
    target.addEventListener("keyup", (event) => this.onKeyUp(event), true);
    // What takes the keyboard away, and with it the release of a key: another window, the end of the
    // document, a menu, the list of a field.
    target.addEventListener("blur", () => this.release());
    target.addEventListener("pagehide", () => this.release());
    target.addEventListener("contextmenu", (event) => event.defaultPrevented || this.release());
    target.addEventListener("pointerdown", (event) => event.target.closest?.("select") && this.release(), true);
  }

  update(drive, isLive) {
    const mode = isLive ? drive.mode : "auto";
    if (mode !== this.mode) this.release();
    this.mode = mode;
    at("pad").hidden = mode === "auto";
    at("pad-mode").textContent = say(`mode.${mode}`);
    at("pad-help").textContent = mode === "auto" ? "" : say(`pad.${mode}`);
    this.drive = drive;
    this.renderNote();
  }

  // Why keys move nothing, or how the last command was changed.
  renderNote() {
    if (this.mode === "auto") return;
    const { kind, text } = this.obstacle() ?? {};
    const { intervention, waypoint } = this.drive;
    const isLacking = kind === "control";
    const shown = isLacking ? text : intervention || text || (waypoint ? say("pad.waypoint") : "");
    setText(at("pad-note"), shown);
    at("pad-note").dataset.kind = intervention || text ? "warn" : "";
    at("pad-take").hidden = !isLacking;
  }

  adoptPad(button) {
    const [forward, turn, tilt] = button.dataset.hold.split(" ").map(Number);
    const end = (event) => {
      if (this.pads.delete(event.pointerId)) this.post();
    };
    button.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      button.setPointerCapture(event.pointerId);
      this.pads.set(event.pointerId, { button, forward, turn, tilt });
      this.post();
    });
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) {
      button.addEventListener(kind, end);
    }
    // Enter holds it, too; Space stops the robot.
    button.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" || event.repeat) return;
      event.preventDefault();
      this.pads.set("Enter", { button, forward, turn, tilt });
      this.post();
    });
    button.addEventListener("keyup", (event) => event.key === "Enter" && end({ pointerId: "Enter" }));
    button.addEventListener("blur", () => end({ pointerId: "Enter" }));
    button.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  onKey(event) {
    // While the command key is held, macOS tells of no release.
    if (event.key === "Meta") this.release();
    if (!(event.code in KEYS) || isTyping(event.target)) return;
    if (event.ctrlKey || event.altKey || event.metaKey || document.querySelector("dialog[open]")) return;
    // viser's client moves the view with the same keys, as long as they are held: a key that is
    // still down when the mode ends would carry the map out of sight.
    if (this.mode === "auto") {
      if (event.view !== window) event.stopImmediatePropagation();
      return;
    }
    event.preventDefault();
    event.stopImmediatePropagation();
    // Ignore a repeat without a press: the key was already down when the input was released.
    if (event.repeat || this.keys.has(event.code)) return;
    this.keys.add(event.code);
    this.post();
  }

  onKeyUp(event) {
    if (!this.keys.delete(event.code)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    this.post();
  }

  release() {
    this.keys.clear();
    this.pads.clear();
    if (this.moving) this.post();
    else this.light();
  }

  held() {
    const sum = { forward: 0, turn: 0, tilt: 0 };
    const parts = [...this.keys].map((code) => KEYS[code]).concat([...this.pads.values()]);
    for (const part of parts) {
      for (const name in sum) sum[name] += part[name] ?? 0;
    }
    for (const name in sum) sum[name] = Math.max(-1, Math.min(1, sum[name]));
    return sum;
  }

  // Shows which buttons are held, by a key or a finger.
  light() {
    const fingers = [...this.pads.values()].map(({ button }) => button);
    for (const button of document.querySelectorAll("[data-hold]")) {
      const isHeld = this.keys.has(`Key${button.querySelector("kbd").textContent}`);
      button.toggleAttribute("data-held", isHeld || fingers.includes(button));
    }
  }

  post() {
    this.light();
    const held = this.held();
    const moves = held.forward !== 0 || held.turn !== 0 || held.tilt !== 0;
    // Send zero once on release, then nothing: an idle page must not override another page.
    if (moves || this.moving) this.send({ type: "hand", t: performance.now(), ...held });
    this.moving = moves;
  }
}

const TEXTUAL = new Set(["text", "search", "email", "url", "tel", "password", "number"]);

// Whether the target takes typed text, so that letters are no driving keys there.
export function isTyping(target) {
  if (target?.isContentEditable) return true;
  const field = target?.closest?.("input, textarea");
  if (field == null || field.readOnly || field.disabled) return false;
  return field.localName === "textarea" || TEXTUAL.has(field.type);
}

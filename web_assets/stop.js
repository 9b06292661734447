// Stop: by a press of the button or by Space, over the WebSocket and over HTTP.

import { BASE } from "./base.js";
import { isTyping } from "./drive.js";

const PATIENCE_MS = 700;
const LIMIT_MS = 3000;
const TOLD_AFTER = 3;
const TRIES = 5;
const CLICK_MS = 1000;
const button = document.getElementById("stop");

export class Stop {
  // command: sends it over the WebSocket and returns the reply; tell: told the last reply, null
  // without one; left: returns the query that says which line was left.
  constructor(command, tell, left) {
    this.command = command;
    this.tell = tell;
    this.left = left;
    this.pressedAt = -Infinity;
    this.listen(window);
    window.addEventListener("pointerdown", (event) => this.onPress(event), true);
    // A click without a press is that of a key, or of a screen reader.
    button.addEventListener("click", (event) => {
      if (event.detail === 0 || event.timeStamp - this.pressedAt > CLICK_MS) this.stop();
    });
  }

  // Listens to the keys of the page or of the scene.
  listen(target) {
    target.addEventListener("keydown", (event) => this.onKey(event), true);
    // Browsers press a focused button when Space is released.
    target.addEventListener("keyup", (event) => this.takes(event), true);
  }

  // A finger stops when it comes down: browsers make no click of it while another holds the pad.
  // Below an open dialog the button itself is told of nothing.
  onPress(event) {
    const isCovered = document.querySelector("dialog[open]") !== null;
    const isOn = isCovered ? isInside(event) : button.contains(event.target);
    if (!isOn || event.button !== 0) return;
    this.pressedAt = event.timeStamp;
    this.stop();
  }

  takes(event) {
    if (event.code !== "Space" || event.ctrlKey || event.altKey || event.metaKey) return false;
    if (isTyping(event.target)) return false;
    event.preventDefault();
    event.stopImmediatePropagation();
    return true;
  }

  onKey(event) {
    if (this.takes(event) && !event.repeat) this.stop();
  }

  // Without a quick reply it is sent over HTTP as well. On a line that is dead both are sent again:
  // the operator is told after three tries, and it may get through a little later.
  async stop() {
    button.dataset.pending = "";
    this.refused = null;
    let reply = null;
    for (let tries = 0; reply === null && tries < TRIES; tries += 1) {
      if (tries === TOLD_AFTER) this.tell(this.refused);
      reply = await this.send();
    }
    delete button.dataset.pending;
    this.tell(reply ?? this.refused);
  }

  // The console itself tries for seconds, and then says why the navigator does not answer.
  hear(answer) {
    if (answer === null || answer.ok) return;
    this.refused = answer;
    this.tell(answer);
  }

  async send() {
    const late = new Promise((settle) => setTimeout(() => settle(null), PATIENCE_MS));
    const asked = this.command();
    asked.then((answer) => this.hear(answer));
    const reply = await Promise.race([asked, late]);
    if (reply?.ok) return reply;
    try {
      const signal = AbortSignal.timeout(LIMIT_MS);
      const path = `${BASE}api/stop${this.left()}`;
      return await (await fetch(path, { method: "POST", signal })).json();
    } catch {
      return null;
    }
  }
}

function isInside({ clientX, clientY }) {
  const { left, right, top, bottom } = button.getBoundingClientRect();
  return left <= clientX && clientX <= right && top <= clientY && clientY <= bottom;
}

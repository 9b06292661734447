// Shows the map first in a new browser: messages for panels and other layers wait until it is drawn.
//
// viser's client shows nothing until everything that it received is built. It passes each batch of
// messages through here; those held back are released once the map is being drawn.

const FIRST = /^\/(map|floor|lights)(\/|$)/;
const PANELS = /Gui|Command|Notification|ReplayDone/;
const PATIENCE_MS = 8000;

function waits(message) {
  return PANELS.test(message.type) || (Boolean(message.name) && !FIRST.test(message.name));
}

globalThis.ipponMapFirst = {
  held: null,
  timer: 0,

  // Start of a connection: discard what was held for the previous one.
  begin() {
    this.held = [];
    clearTimeout(this.timer);
  },

  // Return the messages to pass on now. queue: what the client has yet to draw; go: receives the rest later.
  sieve(batch, queue, go) {
    if (this.held === null) return batch;
    const held = this.held;
    if (held.length === 0) this.timer = setTimeout(() => this.release(held, go), PATIENCE_MS);
    held.push(...batch.filter(waits));
    if (batch.some((message) => message.type === "ReplayDoneMessage")) {
      this.releaseWhenDrawn(held, queue, go);
    }
    return batch.filter((message) => !waits(message));
  },

  releaseWhenDrawn(held, queue, go) {
    // A hidden page draws no frames to wait for.
    if (document.hidden) setTimeout(() => this.release(held, go));
    else if (queue.length > 0) requestAnimationFrame(() => this.releaseWhenDrawn(held, queue, go));
    else requestAnimationFrame(() => setTimeout(() => this.release(held, go)));
  },

  release(held, go) {
    if (this.held !== held) return;
    this.held = null;
    clearTimeout(this.timer);
    go(held);
  },
};

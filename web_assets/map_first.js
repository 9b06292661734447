// The map before everything else: in a browser that has just come, panels and layers wait for it.
//
// viser's client builds whatever came, and shows nothing before all of it is built. It passes each
// batch of messages through here; what is held back goes on once the map's picture is on its way.

const FIRST = /^\/(map|floor|lights)(\/|$)/;
const PANELS = /Gui|Command|Notification|ReplayDone/;
const PATIENCE_MS = 8000;

function waits(message) {
  return PANELS.test(message.type) || (Boolean(message.name) && !FIRST.test(message.name));
}

globalThis.ipponMapFirst = {
  held: null,
  timer: 0,

  // A connection begins: all that was said before is void.
  begin() {
    this.held = [];
    clearTimeout(this.timer);
  },

  // Return what of a batch goes on now; queue: what the client has yet to draw; go: takes the rest.
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

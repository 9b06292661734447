// How often the scene is drawn, and how sharp: as fast as it can while a person uses the page, at a
// part of that otherwise; with fewer pixels where a frame takes long.
//
// viser's client draws without pause for 250 ms after every message. With a robot that reports ten
// times a second this never ends, and without a fast GPU nothing is left for the page. Frames that
// only messages ask for are therefore spaced by a multiple of what one takes. The client judges its
// speed by frames per second, which are then few on every machine: what one takes is the measure here.

const TAIL_MS = 250;
const SPACING = 4;
const LONGEST_MS = 1000;
const USE_MS = 300;
const SHARPNESS = [1, 0.75, 0.5];
const SLOW_MS = 50;
const SMOOTH_MS = 30;
const JUDGED_FRAMES = 8;
const USES = ["pointerdown", "pointermove", "wheel", "keydown", "touchstart", "touchmove"];

globalThis.ipponDrawRate = {
  until: 0,
  drawnAt: 0,
  usedAt: performance.now(),
  frame_ms: 16,
  isTimed: false,
  timer: 0,
  timed: 0,
  blur: 0,

  // A message or a control wants the scene drawn. draw: has the client draw its next frame.
  request(draw) {
    this.until = performance.now() + TAIL_MS;
    this.plan(draw);
  },

  // Called at the start of every frame, whoever asked for it.
  drawn(draw) {
    this.drawnAt = performance.now();
    if (!this.isTimed) this.time(document.querySelector("canvas")?.getContext("webgl2"));
    if (this.drawnAt < this.until) this.plan(draw);
  },

  // Measure how long the GPU, or what stands in for it, takes for the frame that starts now.
  time(gl) {
    if (!gl) return;
    this.isTimed = true;
    const start = performance.now();
    const poll = (fence) => {
      if (gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.UNSIGNALED && !gl.isContextLost()) {
        setTimeout(poll, 8, fence);
        return;
      }
      gl.deleteSync(fence);
      this.frame_ms += 0.3 * (performance.now() - start - this.frame_ms);
      this.isTimed = false;
      this.timed += 1;
    };
    setTimeout(() => {
      const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      gl.flush();
      poll(fence);
    });
  },

  // Called at every frame. setRatio: sets the pixels of the scene for each of the page's.
  sharpen(setRatio) {
    if (this.timed < JUDGED_FRAMES) return;
    const wider = SHARPNESS[this.blur - 1] / SHARPNESS[this.blur];
    if (this.frame_ms > SLOW_MS && this.blur < SHARPNESS.length - 1) this.blur += 1;
    else if (this.frame_ms * wider ** 2 < SMOOTH_MS) this.blur -= 1;
    else return;
    this.timed = 0;
    setRatio(Math.min(Math.max(devicePixelRatio, 1), 2) * SHARPNESS[this.blur]);
  },

  plan(draw) {
    const now = performance.now();
    const isUsed = now - this.usedAt < USE_MS;
    const wait_ms = isUsed ? 0 : this.drawnAt + Math.min(SPACING * this.frame_ms, LONGEST_MS) - now;
    clearTimeout(this.timer);
    if (wait_ms <= 0) draw();
    else this.timer = setTimeout(draw, wait_ms);
  },
};

for (const area of new Set([window, parent])) {
  for (const use of USES) {
    const note = () => (globalThis.ipponDrawRate.usedAt = performance.now());
    area.addEventListener(use, note, { capture: true, passive: true });
  }
}

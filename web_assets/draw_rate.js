// How often the scene is drawn, and how sharp: as fast as it can while a person uses the page, at a
// part of that otherwise; with fewer pixels where a frame takes long.
//
// viser's client draws without pause for 250 ms after every message. With a robot that reports ten
// times a second this never ends, and without a fast GPU nothing is left for the page. Frames that
// only messages ask for are therefore spaced by a multiple of what one takes. The client judges its
// speed by frames per second, which are then few on every machine: what one takes is the measure here.
// Of that, only what the GPU takes becomes less with fewer pixels; browsers that can say so are asked.
//
// A frame that has begun cannot be stopped. Where one takes long, the next begins when it is done, and
// messages are applied before it, not in it: a change that a person asked for is in the first frame.

const TAIL_MS = 250;
const SPACING = 4;
const LONGEST_MS = 1000;
const ANSWER_MS = 1500;
const MOVE_MS = 300;
const SHARPNESS = [1, 0.75, 0.5];
const SLOW_MS = 50;
const SMOOTH_MS = 30;
const JUDGED_FRAMES = 8;
const SCENE = "canvas[data-engine]";
// How long a person's event counts as use of the page: one that may be answered, until it is.
const USES = {
  pointerdown: ANSWER_MS,
  pointerup: ANSWER_MS,
  keydown: ANSWER_MS,
  pointermove: MOVE_MS,
  wheel: MOVE_MS,
  touchmove: MOVE_MS,
};
// Renderers for which four samples a pixel, as lines are smoothed, double the time of a frame.
const SOFTWARE = /SwiftShader|llvmpipe|softpipe|Basic Render|software/i;

function rendererName() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const names = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl?.getParameter(names?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER);
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return name;
}

globalThis.ipponDrawRate = {
  until: 0,
  drawnAt: 0,
  usedUntil: performance.now() + MOVE_MS,
  frame_ms: 16,
  pixels_ms: 16,
  isTimed: false,
  timer: 0,
  timed: 0,
  blur: 0,
  apply: () => {},
  held: null,
  isSmooth: null,

  // A message or a control wants the scene drawn. draw: has the client draw its next frame; apply:
  // has it apply the messages that it received.
  request(draw, apply) {
    this.until = performance.now() + TAIL_MS;
    this.apply = apply;
    this.plan(draw);
  },

  // Called every second: the client draws what may have changed without a request. While the page is
  // used, such a frame would delay that of an answer.
  beat(draw) {
    if (performance.now() >= this.usedUntil) draw();
  },

  // Called at the start of every frame, whoever asked for it.
  drawn(draw) {
    this.drawnAt = performance.now();
    if (!this.isTimed) this.time(document.querySelector(SCENE)?.getContext("webgl2"));
    if (this.drawnAt < this.until) this.plan(draw);
  },

  // Measure the frame that starts now: until the GPU, or what stands in for it, is done with it, and
  // how long it worked on it.
  time(gl) {
    if (!gl) return;
    this.isTimed = true;
    const start = performance.now();
    const timer = gl.getExtension("EXT_disjoint_timer_query_webgl2");
    const query = timer && gl.createQuery();
    if (query) gl.beginQuery(timer.TIME_ELAPSED_EXT, query);
    const poll = (fence, drawn) => {
      if (gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.UNSIGNALED && !gl.isContextLost()) {
        setTimeout(poll, 8, fence, drawn);
        return;
      }
      const end = performance.now();
      const isKnown = query && gl.getQueryParameter(query, gl.QUERY_RESULT_AVAILABLE) &&
        !gl.getParameter(timer.GPU_DISJOINT_EXT);
      const worked_ms = isKnown ? gl.getQueryParameter(query, gl.QUERY_RESULT) / 1e6 : end - drawn;
      gl.deleteSync(fence);
      gl.deleteQuery(query);
      this.frame_ms += 0.3 * (end - start - this.frame_ms);
      this.pixels_ms += 0.3 * (worked_ms - this.pixels_ms);
      this.isTimed = false;
      this.timed += 1;
      if (this.held) this.plan(this.held);
    };
    setTimeout(() => {
      if (query) gl.endQuery(timer.TIME_ELAPSED_EXT);
      const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      gl.flush();
      poll(fence, performance.now());
    });
  },

  // Called at every frame. setRatio: sets the pixels of the scene for each of the page's.
  sharpen(setRatio) {
    if (this.timed < JUDGED_FRAMES) return;
    const wider = SHARPNESS[this.blur - 1] / SHARPNESS[this.blur];
    if (this.pixels_ms > SLOW_MS && this.blur < SHARPNESS.length - 1) this.blur += 1;
    else if (this.pixels_ms * wider ** 2 < SMOOTH_MS) this.blur -= 1;
    else return;
    this.timed = 0;
    setRatio(Math.min(Math.max(devicePixelRatio, 1), 2) * SHARPNESS[this.blur]);
  },

  plan(draw) {
    const now = performance.now();
    const isUsed = now < this.usedUntil;
    const wait_ms = isUsed ? 0 : this.drawnAt + Math.min(SPACING * this.frame_ms, LONGEST_MS) - now;
    clearTimeout(this.timer);
    if (wait_ms <= 0) this.begin(draw);
    else this.timer = setTimeout(() => this.begin(draw), wait_ms);
  },

  begin(draw) {
    this.held = this.isTimed && this.frame_ms > SLOW_MS ? draw : null;
    if (this.held) return;
    this.apply();
    draw();
  },

  // Whether the edges of lines are smoothed.
  smooths() {
    this.isSmooth ??= !SOFTWARE.test(rendererName());
    return this.isSmooth;
  },
};

// The page outlives this document, and would keep it: the whole client, with its map.
const isGone = new AbortController();
addEventListener("pagehide", ({ persisted }) => persisted || isGone.abort());
for (const area of new Set([window, parent])) {
  for (const [use, lasts_ms] of Object.entries(USES)) {
    const note = () => {
      const rate = globalThis.ipponDrawRate;
      rate.usedUntil = Math.max(rate.usedUntil, performance.now() + lasts_ms);
    };
    area.addEventListener(use, note, { capture: true, passive: true, signal: isGone.signal });
  }
}

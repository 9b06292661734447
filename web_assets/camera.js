// The live camera over the scene: small in a corner, or filling the scene. A worker draws the pictures.

import { BASE } from "./base.js";
import { decimal, LANGUAGE, nameOf, say } from "./words.js";

export const OLD_MS = 500; // A drive command needs an image that is at most this old.
const LOST_MS = 2000;
const SIZES = ["corner", "full"];
const KEPT = "ippon-camera";
const at = (id) => document.getElementById(id);

export class Camera {
  // isTyping: whether a key goes to a text field; onResize: called after a change of size.
  constructor(isTyping, onResize) {
    this.isTyping = isTyping;
    this.onResize = onResize;
    this.section = at("camera");
    this.label = "";
    this.drawn = null;
    this.latency = null;
    this.mode = "auto";
    this.before = null;
    this.times = [];
    this.labels = new Set();
    const canvas = at("camera-picture").transferControlToOffscreen();
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.worker = new Worker("/assets/camera_worker.js");
    const words = { stop: say("camera.stop"), slow: say("camera.slow") };
    this.worker.postMessage({ canvas, words, url: `${scheme}://${location.host}${BASE}api/camera` }, [canvas]);
    this.worker.onmessage = ({ data }) => this.hear(data);
    new ResizeObserver(() => this.measure()).observe(at("camera-picture"));
    document.addEventListener("visibilitychange", () => this.wish());
    at("camera-picture").addEventListener("click", () => this.toggle());
    at("camera-size").addEventListener("click", () => this.toggle());
    at("camera-close").addEventListener("click", () => this.resize("off"));
    at("camera-open").addEventListener("click", () => this.resize("corner"));
    at("camera-label").addEventListener("change", (event) => {
      this.label = event.target.value === "-" ? null : event.target.value.slice(1);
      this.wish();
    });
    setInterval(() => this.renderAge(), 100);
    this.resize(localStorage.getItem(KEPT) ?? "corner");
  }

  // Leaves a line that is dead for a new one.
  reconnect() {
    this.worker.postMessage({ reconnect: true });
  }

  get size() {
    return this.section.dataset.size;
  }

  onKey(event) {
    if (event.key === "Escape" && this.size === "full" && this.mode === "auto") {
      // One press closes one thing: what lies over the picture goes first.
      if (this.isTyping(event.target)) return;
      if (document.querySelector("dialog[open], body[data-side], #plan[data-size='full']")) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      this.resize("corner");
      return;
    }
    if (event.code !== "KeyC" || this.isTyping(event.target) || document.querySelector("dialog[open]")) return;
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
    event.preventDefault();
    if (event.shiftKey) this.resize(this.size === "off" ? "corner" : "off");
    else this.toggle();
  }

  toggle() {
    this.resize(this.size === "full" ? "corner" : "full");
  }

  resize(size, isChosen = true) {
    const known = SIZES.includes(size) ? size : "off";
    if (isChosen) {
      this.before = null;
      localStorage.setItem(KEPT, known);
    }
    const held = this.section.contains(document.activeElement);
    this.section.dataset.size = known;
    document.body.dataset.camera = known;
    at("camera-open").hidden = known !== "off";
    if (held && known === "off") at("camera-open").focus({ preventScroll: true });
    const word = say(known === "full" ? "camera.small" : "camera.large");
    at("camera-size").title = word;
    at("camera-size").setAttribute("aria-label", word);
    at("camera-size").setAttribute("aria-pressed", String(known === "full"));
    this.measure();
    this.onResize();
  }

  // A person who drives needs the camera; afterwards it is as it was.
  drive(mode) {
    if (mode === this.mode) return;
    const drove = this.mode !== "auto";
    this.mode = mode;
    if (mode !== "auto" && !drove && this.size !== "full") {
      const before = this.size;
      this.resize("full", false);
      this.before = before;
    } else if (mode === "auto" && this.before !== null) {
      this.resize(this.before, false);
      this.before = null;
    }
  }

  measure() {
    const box = at("camera-picture").getBoundingClientRect();
    const scale = Math.min(devicePixelRatio || 1, 2);
    this.worker.postMessage({ size: { width: box.width, height: box.height, scale } });
    this.longest = this.size === "off" ? 0 : Math.ceil(Math.max(box.width, box.height) * scale);
    this.wish();
  }

  wish() {
    const longest_px = document.hidden ? 0 : Math.min(this.longest ?? 0, 8192);
    this.worker.postMessage({ wish: { longest_px, label: this.label } });
  }

  hear(message) {
    if (message.latency) {
      this.latency = message.latency;
    } else if (message.closed) {
      this.latency = null;
    } else if (message.header) {
      this.drawn = message;
      this.times = [...this.times, message.drawnAt].slice(-20);
      const { stamp_ns, label, labels } = message.header;
      this.section.dataset.stamp = stamp_ns;
      this.section.dataset.drawnAt = message.drawnAt;
      this.section.dataset.bytes = message.bytes;
      // In the corner the box has the shape of the picture; an upright one would be too high.
      this.section.style.setProperty("--shape", Math.max(message.shape, 4 / 3).toFixed(4));
      at("camera-none").hidden = true;
      this.renderLabels(labels, label);
    }
  }

  // How old the picture on the screen is: its age when it was drawn, and the time since.
  age() {
    if (this.drawn === null) return null;
    const { drawnAt, waited_ms, header } = this.drawn;
    return Date.now() - drawnAt + Math.max(this.latency?.ms ?? 0, header.held_ms + waited_ms);
  }

  rate() {
    const [first, last] = [this.times[0], this.times.at(-1)];
    if (this.times.length < 3 || last === first) return null;
    return (1000 * (this.times.length - 1)) / (last - first);
  }

  renderAge() {
    const age = this.age();
    const isPaused = document.body.hasAttribute("data-paused");
    // A recorded picture is neither late nor lost: it is that of the moment that is shown.
    const isRecorded = document.body.classList.contains("review");
    const state = age === null ? "none" : isPaused ? "paused" : isRecorded ? "live"
      : age > LOST_MS ? "lost" : age > OLD_MS ? "old" : "live";
    this.section.dataset.state = state;
    at("camera-age").textContent = age === null ? say("camera.age.none")
      : isPaused ? say("camera.age.paused") : isRecorded ? say("camera.age.recorded") : shownAge(age);
    const rate = isRecorded ? null : this.rate();
    const parts = [];
    if (this.latency && !isPaused && !isRecorded) parts.push(say("camera.latency", { n: Math.round(this.latency.ms) }));
    if (rate !== null && state === "live") parts.push(say("camera.rate", { n: decimal(rate, rate < 3 ? 1 : 0) }));
    at("camera-latency").textContent = parts.join(", ");
    const lag = this.drawn?.header.lag_ms ?? 0;
    at("camera-lag").textContent = lag > 150 ? say("camera.lag", { n: decimal(lag / 1000, 1) }) : "";
    const said = state === "live" && !isRecorded ? say("camera.age.live") : at("camera-age").textContent;
    at("camera-picture").setAttribute("aria-label", say("camera.picture.now", { age: said }));
  }

  renderLabels(labels, drawn) {
    const select = at("camera-label");
    // A detector names what it sees now: the list keeps what it has named, and stays while one chooses.
    if (!labels.every((label) => this.labels.has(label))) {
      for (const label of labels) this.labels.add(label);
      const chosen = select.value;
      const named = [...this.labels].map((label) => [nameOf(label), label]);
      named.sort(([a], [b]) => a.localeCompare(b, LANGUAGE));
      select.replaceChildren(
        new Option(say("camera.object"), "="),
        new Option(say("camera.nothing"), "-"),
        ...named.map(([name, label]) => new Option(name, `=${label}`)),
      );
      select.value = chosen;
    }
    select.title = drawn ? say("camera.drawn", { label: nameOf(drawn) }) : say("camera.drawn.none");
  }
}

function shownAge(ms) {
  return ms < 1000
    ? say("camera.age.ms", { n: Math.round(ms / 10) * 10 })
    : say("camera.age.s", { n: decimal(ms / 1000, 1) });
}

// The plan from above over the scene: names of rooms, measuring, export. Small in the corner while
// the camera fills the scene.

import { BASE, get } from "./base.js";
import { decimal, LANGUAGE, roomOf, say } from "./words.js";
import { cellImage, COLORS, drawPlan, scaleBar } from "./plan_drawing.js";
import { apart, freeArea } from "./plan_layout.js";
import { followPointer } from "./plan_pointer.js";
import { make, replaceRows } from "./side.js";

const EVERY_MS = 500;
const CELLS_MS = 2000;
const SAME_ROOM_M = 2;
// What may lie over the open plan: it fits beside that.
const OVER = ".plan-tools, .camera[data-size='corner'], .side:not([hidden])";
const at = (id) => document.getElementById(id);

export class Plan {
  // isTyping: whether a key goes to a text field; nameRoom: sends a new name and returns the reply; act: has
  // done at a point what a click on the map does, and returns the reply.
  constructor(isTyping, nameRoom, act) {
    this.isTyping = isTyping;
    this.nameRoom = nameRoom;
    this.act = act;
    this.section = at("plan");
    this.canvas = at("plan-picture");
    this.cells = this.image = this.scene = null;
    this.center = null;
    this.scale = 60;
    this.points = [];
    this.pointed = null;
    // The list of rooms that came last; those on the plan, and the button of each.
    this.rooms = null;
    this.placed = [];
    this.fetchedAt = 0;
    this.isFetching = false;
    at("plan-open").addEventListener("click", () => this.toggle());
    at("plan-close").addEventListener("click", () => this.resize("off"));
    at("plan-fit").addEventListener("click", () => this.fit());
    at("plan-measure").addEventListener("click", () => this.measure(!this.measures));
    at("room-cancel").addEventListener("click", () => at("room").close());
    at("room").addEventListener("close", () => this.saveName());
    followPointer(this.canvas, this);
    for (const type of ["focus", "blur"]) this.canvas.addEventListener(type, () => this.draw());
    new ResizeObserver(() => (this.isMoved ? this.draw() : this.fit())).observe(this.canvas);
    setInterval(() => this.fetch(), EVERY_MS);
  }

  get size() {
    return this.section.dataset.size;
  }

  get measures() {
    return at("plan-measure").getAttribute("aria-pressed") === "true";
  }

  // Whether Enter clicks at the cross in the middle: while measuring, and for who works by keyboard.
  get aims() {
    return this.measures || (this.size === "full" && this.canvas.matches(":focus-visible"));
  }

  onKey(event) {
    if (this.isTyping(event.target) || at("room").open || at("help").open) return;
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const isBeside = Boolean(event.target.closest?.(".side"));
    const act = this.size === "full" && !isBeside ? this.keys(event) : null;
    const opens = event.code === "KeyP" ? () => this.toggle() : null;
    const does = opens && !event.repeat ? opens : act;
    if (!does) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    does();
  }

  keys(event) {
    const step = 80 / this.scale;
    const onPlan = event.target === this.canvas || event.target === document.body;
    return {
      m: () => this.measure(!this.measures),
      0: () => this.fit(),
      "+": () => this.zoom(1.25),
      "-": () => this.zoom(0.8),
      Escape: () => this.back(),
      ...(onPlan && {
        ArrowLeft: () => this.move(-step, 0),
        ArrowRight: () => this.move(step, 0),
        ArrowUp: () => this.move(0, step),
        ArrowDown: () => this.move(0, -step),
        ...(this.aims && !event.repeat && { Enter: () => this.click(this.center) }),
      }),
    }[event.key];
  }

  // Closes what was opened last: the exports, measuring, or the plan.
  back() {
    const exports = at("plan-export");
    if (exports.open) {
      exports.open = false;
      exports.querySelector("summary").focus();
    } else if (this.measures) this.measure(false);
    else this.resize("off");
  }

  toggle() {
    this.resize(this.size === "full" ? "off" : "full");
  }

  resize(size) {
    const held = this.section.contains(document.activeElement);
    this.section.dataset.size = size;
    if (held && size === "off") at("plan-open").focus({ preventScroll: true });
    if (size === "full") {
      this.canvas.focus({ preventScroll: true });
      this.fit();
    } else {
      this.measure(false);
      if (size === "off") this.besideCamera();
    }
    at("plan-open").setAttribute("aria-pressed", String(size === "full"));
    this.fetch();
  }

  // While the camera fills the scene, the map is in the corner.
  besideCamera() {
    if (this.size === "full") {
      if (!this.isMoved) this.fit();
      return;
    }
    const size = document.body.dataset.camera === "full" ? "corner" : "off";
    if (size === this.size) return;
    this.section.dataset.size = size;
    this.fit();
    this.fetch();
  }

  async fetch() {
    if (this.size === "off" || document.hidden || this.isFetching) return;
    this.isFetching = true;
    try {
      const scene = await fetched("plan.json");
      this.scene = scene;
      // The map of a navigator that was started again is another one.
      if (scene === null) this.cells = this.image = null;
      const isNew = scene && scene.revision !== this.cells?.revision;
      if (isNew && performance.now() - this.fetchedAt > CELLS_MS) {
        this.fetchedAt = performance.now();
        const cells = await fetched("plan-cells.json");
        const before = this.cells;
        this.cells = cells;
        this.image = cells && cellImage(cells);
        if (String(before?.size) !== String(cells?.size) && !this.isMoved) this.fit();
      }
      at("plan-none").hidden = this.cells !== null;
      this.draw();
    } catch {
      // The page says elsewhere that the console does not respond.
    } finally {
      this.isFetching = false;
    }
  }

  fit() {
    this.isMoved = false;
    const box = this.canvas.getBoundingClientRect();
    if (this.cells === null || box.width === 0) return;
    const { origin_m, size, cell_m } = this.cells;
    const [wide, high] = size.map((n) => n * cell_m);
    const border = this.size === "corner" ? 12 : Math.min(72, 0.08 * Math.min(box.width, box.height));
    const scaleIn = ([left, top, right, bottom]) =>
      Math.min((right - left - border) / wide, (bottom - top - border) / high);
    const over = this.size === "corner" ? [] : [...document.querySelectorAll(OVER)];
    const boxes = over.map((one) => one.getBoundingClientRect())
      .filter(({ width }) => width > 0)
      .map(({ left, top, right, bottom }) =>
        [left - box.left, top - box.top, right - box.left, bottom - box.top]);
    const free = freeArea([0, 0, box.width, box.height], boxes, scaleIn);
    this.scale = Math.max(2, scaleIn(free));
    const [u, v] = [(free[0] + free[2]) / 2, (free[1] + free[3]) / 2];
    this.center = [
      origin_m[0] + wide / 2 + (box.width / 2 - u) / this.scale,
      origin_m[1] + high / 2 - (box.height / 2 - v) / this.scale,
    ];
    this.draw();
  }

  // A point of the world stays where it is on the page: the middle, or that under the pointer.
  zoom(factor, point = this.center) {
    if (this.center === null) return;
    this.isMoved = true;
    const before = this.scale;
    this.scale = Math.min(400, Math.max(4, before * factor));
    const kept = before / this.scale;
    this.center = this.center.map((value, k) => point[k] + (value - point[k]) * kept);
    this.draw();
  }

  move(x, y) {
    if (this.center === null) return;
    this.isMoved = true;
    this.center = [this.center[0] + x, this.center[1] + y];
    this.draw();
  }

  // Brings a place of the world to the middle, with a ring around it.
  point(xy) {
    this.pointed = this.center = xy;
    this.isMoved = true;
    this.scale = Math.max(this.scale, 70);
    this.draw();
  }

  world(event) {
    const box = this.canvas.getBoundingClientRect();
    const [x, y] = this.center;
    return [
      x + (event.clientX - box.left - box.width / 2) / this.scale,
      y - (event.clientY - box.top - box.height / 2) / this.scale,
    ];
  }

  measure(on) {
    at("plan-measure").setAttribute("aria-pressed", String(on));
    this.points = [];
    at("plan-answer").textContent = on ? say("plan.measure.begin") : "";
    if (on) this.canvas.focus({ preventScroll: true });
    this.draw();
  }

  click(point) {
    if (point === null) return;
    if (this.measures) this.mark(point);
    else this.choose(point);
  }

  mark(point) {
    this.points = this.points.length === 2 ? [point] : [...this.points, point];
    const [a, b] = this.points;
    at("plan-answer").textContent = b
      ? say("plan.metres", { n: decimal(Math.hypot(b[0] - a[0], b[1] - a[1]), 2) })
      : say("plan.measure.second");
    this.draw();
  }

  // As on the map: go there, look here, or not here.
  async choose([x_m, y_m]) {
    at("plan-answer").textContent = "…";
    const reply = await this.act({ x_m, y_m });
    if (this.measures) return;
    const otherwise = reply === null ? "link.silence.sentence" : reply.ok ? "goals.done" : "plan.click.choose";
    at("plan-answer").textContent = reply?.text || say(otherwise);
  }

  draw() {
    const box = this.canvas.getBoundingClientRect();
    if (this.size === "off" || box.width === 0) return;
    const dots = Math.min(devicePixelRatio || 1, 2);
    this.canvas.width = Math.round(box.width * dots);
    this.canvas.height = Math.round(box.height * dots);
    const context = this.canvas.getContext("2d");
    context.scale(dots, dots);
    context.fillStyle = COLORS.unknown;
    context.fillRect(0, 0, box.width, box.height);
    if (this.cells === null || this.center === null) {
      this.takeRooms([]);
      return;
    }
    const { center, scale } = this;
    const place = (x, y) => [
      box.width / 2 + (x - center[0]) * scale,
      box.height / 2 - (y - center[1]) * scale,
    ];
    const isSmall = this.size === "corner";
    const taken = isSmall ? [] : this.placeRooms(place);
    drawPlan(context, { ...this, place, isSmall, taken });
    if (isSmall) return;
    this.drawBar(context, box);
    this.drawMeasure(context, place);
    if (this.aims) this.drawCross(context, box);
    if (this.pointed) this.drawRing(context, ...place(...this.pointed));
  }

  drawBar(context, box) {
    const metres = scaleBar(box.width / this.scale);
    const length = metres.toLocaleString(LANGUAGE);
    const [left, low] = [24, box.height - 24];
    context.font = "13px system-ui, sans-serif";
    context.textAlign = "left";
    context.textBaseline = "alphabetic";
    const area = this.scene && decimal(this.scene.explored_m2, 0);
    const text = this.scene ? say("plan.bar", { length, area }) : say("plan.metres", { n: length });
    // The dark edge keeps both readable where the map lies below them.
    context.lineJoin = "round";
    context.fillStyle = "#e8edf3";
    for (const [color, width] of [[COLORS.unknown, 7], ["#e8edf3", 3]]) {
      context.strokeStyle = color;
      context.lineWidth = width;
      context.beginPath();
      context.moveTo(left, low - 6);
      context.lineTo(left, low);
      context.lineTo(left + metres * this.scale, low);
      context.lineTo(left + metres * this.scale, low - 6);
      context.stroke();
    }
    context.lineWidth = 4;
    context.strokeStyle = COLORS.unknown;
    context.strokeText(text, left, low - 12);
    context.fillText(text, left, low - 12);
  }

  drawRing(context, u, v) {
    for (const [color, width] of [["#ffffff", 6], ["#c2185b", 3]]) {
      context.strokeStyle = color;
      context.lineWidth = width;
      context.beginPath();
      context.arc(u, v, 16, 0, 2 * Math.PI);
      context.stroke();
    }
  }

  drawMeasure(context, place) {
    if (!this.measures) return;
    context.strokeStyle = context.fillStyle = "#c2185b";
    context.lineWidth = 2.5;
    const points = this.points.map((point) => place(...point));
    context.beginPath();
    for (const [n, point] of points.entries()) context[n ? "lineTo" : "moveTo"](...point);
    context.stroke();
    for (const [u, v] of points) context.fillRect(u - 4, v - 4, 8, 8);
    if (points.length === 2) this.drawLength(context, ...points);
  }

  drawCross(context, box) {
    const [u, v] = [box.width / 2, box.height / 2];
    for (const [color, width] of [["#ffffff", 4], ["#c2185b", 2]]) {
      context.strokeStyle = color;
      context.lineWidth = width;
      context.beginPath();
      for (const [x, y] of [[10, 0], [0, 10]]) {
        context.moveTo(u - x, v - y);
        context.lineTo(u + x, v + y);
      }
      context.stroke();
    }
  }

  // Beside the middle of the measured line, readable on any ground.
  drawLength(context, [u0, v0], [u1, v1]) {
    context.font = "600 14px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "bottom";
    const [u, v] = [(u0 + u1) / 2, (v0 + v1) / 2 - 8];
    context.lineWidth = 4;
    context.strokeStyle = "rgb(255 255 255 / 90%)";
    const text = at("plan-answer").textContent;
    context.strokeText(text, u, v);
    context.fillText(text, u, v);
    context.strokeStyle = "#c2185b";
  }

  // Returns the boxes of the names. The name of a larger room is closer to its place.
  placeRooms(place) {
    this.takeRooms(this.scene?.rooms ?? []);
    const order = [...this.placed].sort((a, b) => b.room.area_m2 - a.room.area_m2);
    const boxes = apart(order.map(({ room, button }) => {
      const [u, v] = place(room.x_m, room.y_m);
      const [wide, high] = [button.offsetWidth / 2, button.offsetHeight / 2];
      return [u - wide, v - high, u + wide, v + high];
    }));
    for (const [k, [left, top]] of boxes.entries()) {
      order[k].button.style.transform = `translate(${left}px, ${top}px)`;
    }
    return boxes;
  }

  // A room that grows keeps its button: it may be pressed just now.
  takeRooms(rooms) {
    // The plan is drawn far more often than its rooms come.
    if (rooms === this.rooms) return;
    this.rooms = rooms;
    const before = [...this.placed];
    const held = before.some(({ button }) => button === document.activeElement);
    this.placed = rooms.map((room) => {
      const known = sameRoom(room, before);
      const one = known < 0 ? this.roomButton() : before.splice(known, 1)[0];
      if (one.room !== room) describe(one, room);
      return one;
    });
    replaceRows(at("plan-rooms"), this.placed.map(({ button }) => button));
    if (held && !at("plan-rooms").contains(document.activeElement)) this.canvas.focus({ preventScroll: true });
  }

  roomButton() {
    const one = { room: null, button: make("button") };
    one.button.type = "button";
    one.button.addEventListener("click", () => this.askName(one.room));
    return one;
  }

  askName(room) {
    this.renamed = room;
    at("room-name").value = room.name;
    at("room-hint").textContent = room.kind
      ? say("plan.room.kind", { kind: roomOf(room.kind) })
      : say("plan.room.unknown");
    at("room").returnValue = "";
    at("room").showModal();
    at("room-name").select();
  }

  async saveName() {
    if (at("room").returnValue !== "save" || !this.renamed) return;
    const { x_m, y_m } = this.renamed;
    const reply = await this.nameRoom({ x_m, y_m, name: at("room-name").value });
    at("plan-answer").textContent = reply?.text ?? say("link.silence.sentence");
    this.canvas.focus({ preventScroll: true });
  }
}

function describe(one, room) {
  const { button } = one;
  one.room = room;
  const shown = room.name || roomOf(room.kind) || say("plan.room.unnamed");
  if (button.textContent !== shown) button.textContent = shown;
  button.dataset.named = String(room.name !== "" || room.kind !== "");
  const area = decimal(room.area_m2, 0);
  button.setAttribute("aria-label", say("plan.room.rename", { room: shown, area }));
  button.title = say("plan.room.rename.hint", { area });
}

// Index of a room among those before: the closest one. A room that grows moves its name.
function sameRoom(room, before) {
  const away = before.map((one) => Math.hypot(one.room.x_m - room.x_m, one.room.y_m - room.y_m));
  const least = Math.min(...away);
  return least < SAME_ROOM_M ? away.indexOf(least) : -1;
}

// Returns null while there is no map.
async function fetched(name) {
  const answer = await get(`${BASE}api/export/${name}`);
  if (answer.status === 404) return null;
  if (!answer.ok) throw new Error(`${name}: ${answer.status}`);
  return answer.json();
}

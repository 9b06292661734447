// The page around the scene: status bar, Stop, reconnection. The scene and its panels are in an iframe.

import { BASE } from "./base.js";
import { showAnswers } from "./answers.js";
import { Calls } from "./calls.js";
import { Camera, OLD_MS } from "./camera.js";
import { Drive, isTyping } from "./drive.js";
import { Explanation } from "./explain.js";
import { installFold } from "./fold.js";
import { installHelp, installTheme } from "./help.js";
import { installHover } from "./hover.js";
import { Introduction } from "./introduction.js";
import { clock, Goals } from "./goals.js";
import { Lease, logInAgainIfAsked } from "./lease.js";
import { Notice } from "./notice.js";
import { nameFields } from "./panel_names.js";
import { openSearchAt } from "./panel_tabs.js";
import { Plan } from "./plan.js";
import { Sides } from "./side.js";
import { Things } from "./things.js";
import { Robots } from "./robots.js";
import { showWalk } from "./walk.js";
import { followSceneArea } from "./scene_area.js";
import { closeScene, isSceneGone, onScene, reloadScene } from "./scene_frame.js";
import { Stop } from "./stop.js";
import { setText } from "./text.js";
import { Waiting } from "./waiting.js";
import { decimal, has, say } from "./words.js";

const PING_MS = 2000;
const LATE_MS = 1500;
const SILENT_PINGS = 2;
const CONNECT_PINGS = 7;
const RETRY_MS = [250, 500, 1000, 2000];

const stateWord = (state) => (has(`state.${state}`) ? say(`state.${state}`) : state);

const at = (id) => document.getElementById(id);
const view = at("view");

let socket = null;
let attempt = 0;
let heardAt = 0;
let trip = null; // Round trip of the last ping, until the next one.
let lateAt = -Infinity; // When the console told that keys arrive too late.
let unanswered = 0; // Pings since the last message: a page that slept has sent none.
let leftAt = null; // When the last message came on a line that was left, until there is another line.
let instance = null;
let edition = null; // Of the console's pages when this one was opened.
let isOutdated = false;
let state = null;
let robot = say("page.robot.none");
let nextCommand = 1;
let tellTheme = () => {};
const pending = new Map();

function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}${BASE}api/ws${left()}`);
  unanswered = 0;
  socket.onopen = () => {
    attempt = 0;
    hear();
    sendPing();
    tellTheme();
    replaceOthers();
  };
  socket.onmessage = (event) => {
    hear();
    receive(JSON.parse(event.data));
  };
  socket.onclose = lose;
}

function hear() {
  heardAt = performance.now();
  unanswered = 0;
}

function lose() {
  socket = null;
  state = null;
  for (const settle of pending.values()) settle(null);
  pending.clear();
  drive.release();
  render();
  logInAgainIfAsked();
  setTimeout(connect, RETRY_MS[Math.min(attempt, RETRY_MS.length - 1)]);
  attempt += 1;
}

// Leaves a line on which nothing arrives. Browsers report it as closed minutes later.
function abandon() {
  if (socket.readyState === WebSocket.OPEN) leftAt ??= heardAt;
  else freeOthers();
  socket.onopen = socket.onmessage = socket.onclose = null;
  socket.close();
  lose();
}

// A browser opens the sockets to a console one after the other: a handshake of the camera or the scene
// that hangs on a dead line holds this one up.
function freeOthers() {
  camera.reconnect();
  closeScene();
}

// Tells the console that a line was left: what was sent there may arrive now, a Resume after a Stop.
function left() {
  if (leftAt === null) return "";
  return `?silent_s=${((performance.now() - leftAt) / 1000).toFixed(1)}`;
}

// The sockets of camera and scene were on the line that was left, too.
function replaceOthers() {
  if (leftAt !== null) camera.reconnect();
  if (leftAt !== null || isSceneGone()) reloadScene();
  leftAt = null;
}

function receive(message) {
  if (message.type === "pong") {
    trip = performance.now() - message.t;
    at("latency").textContent = `${Math.max(1, Math.round(trip))} ms`;
    at("latency").classList.toggle("slow", trip > 200);
    reloadIfOutdated(); // Here, as the console answers now: without one the page would be lost.
  } else if (message.type === "late") {
    lateAt = performance.now();
  } else if (message.type === "reply") {
    pending.get(message.id)?.(message);
    pending.delete(message.id);
  } else if (message.type === "you") {
    lease.meet(message);
    edition ??= message.edition;
    isOutdated = message.edition !== edition;
    render(); // The pad, too: a robot that says nothing new sends no state after it.
  } else if (message.type === "stalled") {
    if (state !== null) state = { ...state, link: "stalled" };
    render();
  } else if (message.type === "state") {
    instance = message.instance;
    state = message;
    render();
  }
}

// A console that was started again in another language or version has another page than this one.
// What is being typed or sent comes first; keys that are held are released with the page.
function reloadIfOutdated() {
  const { activeElement } = document;
  const isTyped = isTyping(activeElement) && activeElement.value !== "";
  const isSent = pending.size > 0 || "pending" in at("stop").dataset;
  if (isOutdated && !isTyped && !isSent) location.reload();
}

function sendPing() {
  send({ type: "ping", t: performance.now(), trip });
  trip = null;
}

function ping() {
  if (socket === null) return;
  const isOpen = socket.readyState === WebSocket.OPEN;
  if (unanswered >= (isOpen ? SILENT_PINGS : CONNECT_PINGS)) {
    abandon();
    return;
  }
  unanswered += 1;
  sendPing();
}

function request(message) {
  return new Promise((settle) => {
    if (socket?.readyState !== WebSocket.OPEN) {
      settle(null);
      return;
    }
    const id = nextCommand++;
    pending.set(id, settle);
    socket.send(JSON.stringify({ ...message, id }));
  });
}

function command(action) {
  return request({ type: "control", action });
}

const COMPLAINT_MS = 8000;
let notDelivered = null;
let complaint = 0;

function complain(text) {
  notDelivered = text;
  clearTimeout(complaint);
  if (text !== null) complaint = setTimeout(() => complain(null), COMPLAINT_MS);
  render();
}

function judge(reply) {
  complain(reply === null ? say("link.silence") : reply.ok ? null : reply.text);
}

const insist = async (answer) => judge(await answer);

function send(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

// Why the driving keys move nothing; a robot without control answers nothing.
function obstacle() {
  if (!lease.holds) return { kind: "control", text: say("pad.control") };
  if (performance.now() - lateAt < LATE_MS) return { kind: "line", text: say("pad.late") };
  const age = camera.size === "off" ? null : camera.age();
  if (age === null || age <= OLD_MS) return null;
  return { kind: "picture", text: say("pad.old", { n: decimal(age / 1000, 1) }) };
}

const stop = new Stop(() => command("stop"), judge, left);
const drive = new Drive(send, (mode) => insist(request({ type: "drive", mode })), obstacle);
const lease = new Lease(send, (action, requester) => insist(request({ type: "lease", action, requester })), view);
const verdict = (word) => ({ find }) =>
  insist(request({ type: "verdict", verdict: word, goal_id: find.goal_id, find: find.number }));
const notice = new Notice({
  places: () => openSearchAt(view, ".ip-not-found"),
  show: ({ find }) => {
    openSearchAt(view, ".ip-now");
    lookAt(find.position, find.size);
  },
  confirm: verdict("confirm"),
  reject: verdict("reject"),
});
const explanation = new Explanation();
const introduction = new Introduction(view);
const onHelpKey = installHelp(isTyping);
const plan = new Plan(
  isTyping,
  (room) => request({ type: "room", ...room }),
  (point) => request({ type: "point", ...point }),
);
const camera = new Camera(isTyping, () => plan.besideCamera());
const sides = new Sides(isTyping);
const isRecorded = () => document.body.classList.contains("review");
const mayChange = () => !isRecorded() && lease.watching === "";
const calls = new Calls(sides, request, mayChange, lookAt);
const goals = new Goals(sides, request, mayChange, lookAt);
new Things(sides, lookAt, request);
new Robots(sides, stateWord);
const waiting = new Waiting();
const onHover = installHover(view, request);
const onSideKey = (event) => sides.onKey(event);
const onPlanKey = (event) => plan.onKey(event);
const onExplanationKey = (event) => explanation.onKey(event);
const onCameraKey = (event) => camera.onKey(event);
const onIntroductionKey = (event) => introduction.onKey(event);

// Shows a place of the world on the plan if that is open.
function showOnPlan(position) {
  if (document.body.dataset.camera === "full") plan.resize("full");
  if (plan.size === "full") plan.point(position.slice(0, 2));
}

// Shows a thing, and has the scene fly there and explain it.
function lookAt(position, size, thing, share) {
  // There an open list covers what it shows.
  if (matchMedia("(max-width: 760px)").matches && sides.open !== null) sides.toggle(sides.open);
  showOnPlan(position);
  const at_once = matchMedia("(prefers-reduced-motion: reduce)").matches;
  send({ type: "look", position, size, thing, share, at_once });
}

const frameMap = () => send({ type: "frame" });

function onHomeKey(event) {
  if (event.code !== "KeyH" || isTyping(event.target)) return;
  if (event.ctrlKey || event.altKey || event.metaKey || document.querySelector("dialog[open]")) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  frameMap();
}

function shownState() {
  if (socket?.readyState !== WebSocket.OPEN || state === null) {
    return instance === null ? "connecting" : "disconnected";
  }
  if (state.link === "waiting") return "waiting";
  return state.state ?? "waiting";
}

function render() {
  const shown = shownState();
  const live = state !== null;
  document.body.dataset.state = shown;
  setText(at("state"), stateWord(shown));
  if (state?.robot) robot = state.robot;
  setText(at("robot"), robot);
  setText(at("why"), state?.link === "live" ? state.why : "");
  at("why").title = at("why").textContent;
  setText(at("goal"), state?.object ?? "");
  at("goal").title = state?.object ?? "";
  setText(at("elapsed"), state?.object ? clock(state.elapsed_s) : "");
  document.title = state?.object ? `${stateWord(shown)}: ${state.object} – IPPON` : "IPPON";
  const age = live && state.link === "live" ? state.frame_age_ms : null;
  at("frame-age").textContent = age === null ? "–" : `${Math.round(age)} ms`;
  at("frame-age").classList.toggle("slow", age !== null && age > 400);
  at("link").dataset.link = live ? state.link : "down";
  at("mode").textContent = live && state.link !== "waiting" ? say(`mode.${state.drive.mode}`) : "–";
  at("latency").hidden = !live;
  const heard = live && state.link !== "waiting" ? state.link : "none";
  at("heard").textContent = say(`link.${heard}`, { n: Math.round(state?.silent_s ?? 0) });
  at("resume").hidden = shown !== "stopped";
  lease.update(state?.lease);
  goals.update(state);
  calls.update(state);
  if (live) explanation.update(state.explanation);
  showWalk(state?.link === "live" ? state.walk : null);
  drive.update(state?.drive ?? { mode: "auto" }, state?.link === "live" && lease.watching === "");
  // Who watches somebody else drive keeps the camera as it is.
  const drives = lease.watching === "" ? state?.drive.mode : "auto";
  camera.drive(live && state.link === "live" ? drives : camera.mode);
  // Stopping releases all keys: after Resume the operator must press one again.
  if (shown === "stopped") drive.release();
  notice.render(state, shown, notDelivered, mayChange());
  renderVeil(shown);
}

function renderVeil(shown) {
  const texts = {
    connecting: ["veil.connecting", say("veil.connecting.text"), ""],
    disconnected: ["veil.disconnected", say("veil.disconnected.text"), say("veil.disconnected.hint")],
    waiting: state?.starting
      ? ["veil.starting", say(`veil.starting.${state.starting}`), ""]
      : ["veil.waiting", state?.link_text ?? "", say("veil.waiting.hint")],
  };
  const text = texts[shown];
  at("veil").hidden = text === undefined || (shown === "waiting" && state?.has_map);
  waiting.update(shown === "waiting" && !at("veil").hidden);
  if (text === undefined) {
    if (!document.body.classList.contains("review")) introduction.begin();
    return;
  }
  setText(at("veil-title"), say(text[0]));
  setText(at("veil-text"), text[1]);
  setText(at("veil-hint"), text[2]);
}

// viser's client reconnects only while its document has the focus. A wall display never has it,
// and neither does the frame while the operator uses our bar; so the frame is told that it does.
function adoptScene(inner) {
  const scene = inner.defaultView;
  inner.hasFocus = () => true;
  stop.listen(scene);
  listenToKeys(scene);
  drive.listen(scene);
  onHover(scene);
  calls.listen(scene);
  showAnswers(inner);
  nameFields(inner);
  inner.addEventListener("keydown", changeBox);
  scene.dispatchEvent(new Event("focus"));
}

// Space stops the robot wherever the focus is, so Enter changes a checkbox.
function changeBox(event) {
  if (event.key !== "Enter" || event.repeat || event.target.type !== "checkbox") return;
  event.preventDefault();
  event.target.click();
}

function listenToKeys(target) {
  for (const onKey of [onHelpKey, onCameraKey, onPlanKey, onSideKey, onHomeKey]) {
    target.addEventListener("keydown", onKey, true);
  }
  target.addEventListener("keydown", onExplanationKey);
  target.addEventListener("keydown", onIntroductionKey);
}

listenToKeys(window);
at("home").addEventListener("click", frameMap);
at("resume").addEventListener("click", () => insist(command("resume")));
setInterval(ping, PING_MS);
connect();
onScene(adoptScene);
tellTheme = installTheme(view, (theme) => send({ type: "theme", light: theme === "light" }));
installFold(view);
followSceneArea(view, () => camera.measure());
render();

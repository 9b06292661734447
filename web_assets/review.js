// The timeline of a recording: play, seek, marks and notes. The scene above it is the console's.

import { get } from "/assets/base.js";
import { onScene } from "/assets/scene_frame.js";
import { decimal, has, percent, say, LANGUAGE } from "/assets/words.js";
import { sumOf } from "/review/outcomes.js";

// In the order of the legend; review.css has their colours.
const KINDS = [
  "query", "levels", "detection", "found", "confirmed", "rejected", "exhausted", "cancelled", "contact", "takeover",
  "stopped", "lost", "error", "note",
];
const SHOWN_AFTER_S = 0.3;
const PICTURE_PX = 104;
const MOST_FOUND = 50;
const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];

const make = (tag, name, text) => {
  const node = document.createElement(tag);
  if (name) node.className = name;
  if (text !== undefined) node.textContent = text;
  return node;
};
const kindOf = (kind) => (has(`review.kind.${kind}`) ? say(`review.kind.${kind}`) : kind);
const clock = (s) => {
  const tenths = Math.round(10 * s);
  return `${Math.floor(tenths / 600)}:${decimal((tenths % 600) / 10, 1).padStart(4, "0")}`;
};

document.body.classList.add("review");
const bar = make("footer", "timeline");
const transport = make("div", "transport");
const track = make("div", "track");
const strip = make("div", "strip");
const legend = make("div", "keys-of-marks");
const versus = make("table", "versus");
const back = make("button", "", "‹");
const play = make("button", "play", say("review.play"));
const forward = make("button", "", "›");
const speed = make("select");
const time = make("span", "clock");
const said = make("span", "said");
const text = make("input");
const note = make("button", "", say("review.note"));
const mark = make("button", "", say("review.mark"));
const sessions = make("button", "", say("review.sessions"));
const link = make("button", "", say("review.link"));
const wanted = make("input");
const found = make("ol", "found-events");
back.title = say("review.back.hint");
forward.title = say("review.forward.hint");
play.title = say("review.play.hint");
speed.title = say("review.speed");
text.placeholder = say("review.note.field");
text.maxLength = 2000;
text.type = "text";
link.title = say("review.link.hint");
wanted.type = "search";
wanted.placeholder = say("review.search");
wanted.setAttribute("aria-label", say("review.search"));
text.setAttribute("aria-label", say("review.note.field"));
speed.setAttribute("aria-label", say("review.speed"));
back.setAttribute("aria-label", say("review.back.hint"));
forward.setAttribute("aria-label", say("review.forward.hint"));
found.hidden = true;
for (const s of SPEEDS) speed.append(new Option(`${s.toLocaleString(LANGUAGE)}×`, s, s === 1, s === 1));
transport.append(sessions, back, play, forward, speed, time, said, wanted, text, note, mark, link);
const done = make("div", "done");
const head = make("div", "head");
const tip = make("div", "tip");
tip.hidden = true;
bar.append(found, transport, track, strip, legend, versus);
document.body.append(bar);

let socket = null;
let session = null;
let version = -1;
let asked = 0;
let answered = 0;
let state = { position_s: 0, playing: false, speed: 1, problem: "" };
let dragging = false;
let marked = "";
let marks = [];
let pictured = { of: "", count: 0, duration_s: 0 };

// Returns whether the console was there to be sent it.
function send(action, value = 0, words = "") {
  if (socket?.readyState !== WebSocket.OPEN) return false;
  socket.send(JSON.stringify({ action, value, text: words }));
  return true;
}

function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}/review/ws`);
  socket.onmessage = (event) => {
    const told = JSON.parse(event.data);
    if (told.type === "stalled") {
      // What plays hangs; once it goes on, it tells its state.
      state = { ...state, problem: say("notice.stalled") };
      render();
      return;
    }
    state = told;
    if (state.version !== version) load(state.version);
    render();
  };
  socket.onclose = () => setTimeout(connect, 500);
}

async function load(next) {
  version = next;
  asked += 1;
  const number = asked;
  let loaded;
  try {
    loaded = await (await get("/review/session")).json();
  } catch {
    // The next state asks again.
    if (version === next) version = -1;
    return;
  }
  // An answer to an earlier question may be older than what is shown.
  if (number < answered) return;
  answered = number;
  const isFirst = session === null;
  session = loaded;
  drawMarks();
  sessions.hidden = !session.has_list;
  compare();
  drawStrip();
  render();
  if (isFirst) openMoment();
}

// `#t=83.2` opens that moment, in a link as well as typed into the address.
function openMoment() {
  const at = /^#t=(\d+(\.\d+)?)$/.exec(location.hash);
  if (at) send("seek", Number(at[1]));
}

const pictureOf = (at) => `/review/moment?at=${at.toFixed(1)}&v=${version}`;

// A session that is being recorded is loaded every other second: what is pressed, focused or read
// stays while it is the same.
function drawMarks() {
  const all = [...session.marks, ...session.notes];
  const key = JSON.stringify(all);
  if (key !== marked) {
    marked = key;
    track.replaceChildren(done, head, tip);
    marks = all.map(addMark);
    const kinds = new Set(all.map((m) => (m.kind === "mark" ? "note" : m.kind)));
    legend.replaceChildren();
    for (const kind of KINDS.filter((one) => kinds.has(one))) {
      const item = make("span");
      item.append(make("i", kind), kindOf(kind));
      legend.append(item);
    }
    search();
  }
  for (const { node, at_s } of marks) {
    node.style.left = `${(100 * at_s) / Math.max(session.duration_s, 0.1)}%`;
  }
}

// Its pictures stay until they are half a picture off.
function drawStrip() {
  const count = Math.max(3, Math.min(16, Math.floor(strip.clientWidth / PICTURE_PX)));
  const of = JSON.stringify([session.link, session.sessions.map((one) => one.name)]);
  const grown = session.duration_s - pictured.duration_s;
  const isSame = of === pictured.of && count === pictured.count;
  if (isSame && grown >= 0 && 2 * count * grown <= pictured.duration_s) return;
  pictured = { of, count, duration_s: session.duration_s };
  strip.replaceChildren();
  for (let n = 0; n < count; n++) {
    const at = (session.duration_s * (n + 0.5)) / count;
    const button = make("button");
    const image = make("img");
    button.type = "button";
    button.setAttribute("aria-label", say("review.camera", { time: clock(at) }));
    image.alt = "";
    image.loading = "lazy";
    image.onerror = () => image.remove();
    image.src = pictureOf(at);
    button.append(image);
    button.onclick = () => send("seek", at);
    strip.append(button);
  }
}

// Events and notes that hold every word, in the order of their time.
function search() {
  const words = wanted.value.trim().toLowerCase().split(/\s+/).filter(Boolean);
  const all = [...session.marks, ...session.notes].sort((a, b) => a.at_s - b.at_s);
  const matches = words.length === 0 ? [] : all.filter((m) => {
    const line = `${m.kind} ${kindOf(m.kind)} ${m.text}`.toLowerCase();
    return words.every((word) => line.includes(word));
  });
  found.replaceChildren();
  for (const m of matches.slice(0, MOST_FOUND)) {
    const line = make("li");
    const button = make("button");
    button.type = "button";
    button.append(make("b", "", clock(m.at_s)), ` ${m.text || kindOf(m.kind)}`);
    button.onclick = () => send("seek", m.at_s + SHOWN_AFTER_S);
    line.append(button);
    found.append(line);
  }
  const more = matches.length - MOST_FOUND;
  if (words.length > 0 && matches.length === 0) found.append(make("li", "none", say("review.search.none")));
  if (more > 0) found.append(make("li", "none", say("review.search.more", { n: more })));
  found.hidden = words.length === 0;
}

function addMark(m) {
  const kind = m.kind === "mark" ? "note" : m.kind;
  const button = make("button", `mark ${kind} lane${m.lane}`);
  button.type = "button";
  button.setAttribute("aria-label", `${clock(m.at_s)} ${m.text || kindOf(kind)}`);
  button.onclick = (event) => {
    event.stopPropagation();
    // Seek slightly past the event, so that its effect is visible.
    send("seek", m.at_s + SHOWN_AFTER_S);
  };
  button.onpointerdown = (event) => event.stopPropagation();
  button.onpointerenter = () => show(m.at_s, `${clock(m.at_s)}  ${m.text || kindOf(kind)}`);
  button.onpointerleave = () => (tip.hidden = true);
  track.append(button);
  return { node: button, at_s: m.at_s };
}

function compare() {
  versus.replaceChildren();
  if (session.sessions.length < 2) return;
  const columns = ["object", "outcome", "time", "path", "explored", "best"];
  const row = versus.createTHead().insertRow();
  row.append(make("td"), ...columns.map((name) => make("th", "", say(`review.compare.${name}`))));
  const body = versus.createTBody();
  for (const [n, s] of session.sessions.entries()) {
    const sum = sumOf(s.goals);
    const cells = [
      `${say(n === 0 ? "review.compare.left" : "review.compare.right")}  ${s.name}`, sum.objects,
      sum.outcome, clock(s.duration_s), `${decimal(s.path_length_m, 1)} m`,
      `${decimal(s.explored_m2, 1)} m²`, s.best_ooi === null ? "–" : percent(s.best_ooi),
    ];
    const line = body.insertRow();
    for (const cell of cells) line.insertCell().textContent = cell;
  }
}

function show(at, words) {
  tip.textContent = words;
  tip.hidden = false;
  // Keep the whole tooltip on the track.
  const [half, wide] = [tip.offsetWidth / 2, track.clientWidth];
  const middle = (wide * at) / Math.max(session.duration_s, 0.1);
  tip.style.left = `${Math.max(half, Math.min(wide - half, middle))}px`;
}

function render() {
  if (session === null) return;
  const share = `${Math.min(100, (100 * state.position_s) / Math.max(session.duration_s, 0.1))}%`;
  done.style.width = share;
  head.style.left = share;
  document.body.toggleAttribute("data-paused", !state.playing);
  play.textContent = say(state.playing ? "review.pause" : "review.play");
  if (document.activeElement !== speed) speed.value = state.speed;
  time.replaceChildren(clock(state.position_s), make("small", "", ` / ${clock(session.duration_s)}`));
  // A file that is still being written is incomplete; do not report that as a problem.
  const problem = state.problem || (state.growing ? "" : session.problems.join("; "));
  const first = session.sessions[0];
  const live = state.growing ? `${say("review.growing")} – ` : "";
  const ended = state.ended ? `${say("review.ended")} – ` : "";
  said.textContent = problem || (first ? `${live || ended}${first.name}` : "");
  said.title = said.textContent;
  said.classList.toggle("problem", problem !== "");
}

function at(event) {
  const box = track.getBoundingClientRect();
  const share = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
  return share * session.duration_s;
}

track.onpointerdown = (event) => {
  dragging = true;
  track.setPointerCapture(event.pointerId);
  send("seek", at(event));
};
track.onpointermove = (event) => {
  if (session === null) return;
  if (dragging) send("seek", at(event));
  if (event.target === track) show(at(event), clock(at(event)));
};
track.onpointerup = track.onpointercancel = () => (dragging = false);
track.onpointerleave = () => (tip.hidden = true);

function toggle() {
  send(state.playing ? "pause" : "play");
}

play.onclick = toggle;
back.onclick = () => send("step", -1);
forward.onclick = () => send("step", 1);
speed.onchange = () => send("speed", Number(speed.value));
mark.onclick = () => send("mark");
note.onclick = () => {
  if (text.value.trim() === "") return;
  if (send("note", 0, text.value.trim())) text.value = "";
};
text.onkeydown = (event) => {
  if (event.key === "Enter") note.onclick();
};
wanted.oninput = () => session && search();
wanted.onkeydown = (event) => {
  if (event.key === "Enter") found.querySelector("button")?.click();
  if (event.key === "Escape") {
    wanted.value = "";
    search();
  }
};
link.onclick = async () => {
  const url = `${location.origin}${session.link}#t=${state.position_s.toFixed(1)}`;
  history.replaceState(null, "", url);
  try {
    await navigator.clipboard.writeText(url);
    link.textContent = say("review.link.copied");
  } catch {
    // Without permission to the clipboard, the address line holds the link.
    link.textContent = say("review.link.address");
  }
  setTimeout(() => (link.textContent = say("review.link")), 2000);
};
window.addEventListener("hashchange", openMoment);
let resized = 0;
window.addEventListener("resize", () => {
  clearTimeout(resized);
  resized = setTimeout(() => session && drawStrip(), 300);
});
sessions.onclick = () => (location.href = "/sessions");
sessions.hidden = true;

// The plan takes arrows there.
const isOnPlan = (target) => document.querySelector("#plan[data-size='full']") !== null
  && (target === document.body || target.id === "plan-picture");

// Handles keys before the shell does: there Space stops the robot, here it plays and pauses.
function onKey(event) {
  if (event.target?.closest?.("input, textarea, select")) return;
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  // A dialog scrolls by arrows and Home.
  if (event.code !== "Space" && document.querySelector("dialog[open]")) return;
  const keys = {
    Space: toggle,
    Comma: () => send("step", -1),
    Period: () => send("step", 1),
    ...(!isOnPlan(event.target) && {
      ArrowLeft: () => send("seek", state.position_s - 5),
      ArrowRight: () => send("seek", state.position_s + 5),
    }),
    Home: () => send("seek", 0),
  };
  const act = keys[event.code];
  if (act === undefined) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  act();
}

window.addEventListener("keydown", onKey, true);
onScene((inner) => inner.defaultView.addEventListener("keydown", onKey, true));
connect();

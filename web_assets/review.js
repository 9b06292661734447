// The timeline of a recording: play, seek, marks and notes. The scene above it is the console's.

const KINDS = {
  query: ["query", "#56b4e9"], levels: ["levels", "#e69f00"], detection: ["looks like it", "#f0e442"],
  found: ["found", "#009e73"], rejected: ["rejected", "#e5322d"], contact: ["contact", "#d55e00"],
  takeover: ["manual drive", "#cc79a7"], note: ["note", "#e8edf3"],
};
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
const clock = (s) => {
  const tenths = Math.round(10 * s);
  return `${Math.floor(tenths / 600)}:${((tenths % 600) / 10).toFixed(1).padStart(4, "0")}`;
};

document.body.classList.add("review");
const bar = make("footer", "timeline");
const transport = make("div", "transport");
const track = make("div", "track");
const strip = make("div", "strip");
const legend = make("div", "keys-of-marks");
const versus = make("table", "versus");
const back = make("button", "", "‹");
const play = make("button", "play", "Play");
const forward = make("button", "", "›");
const speed = make("select");
const time = make("span", "clock");
const said = make("span", "said");
const text = make("input");
const note = make("button", "", "Note");
const mark = make("button", "", "Mark");
const sessions = make("button", "", "Sessions");
const link = make("button", "", "Link");
const wanted = make("input");
const found = make("ol", "found-events");
back.title = "Previous image (,)";
forward.title = "Next image (.)";
play.title = "Play or pause (Space)";
speed.title = "Speed";
text.placeholder = "Note at this time";
text.maxLength = 2000;
text.type = "text";
link.title = "Copy a link to this moment";
wanted.type = "search";
wanted.placeholder = "Search events";
wanted.setAttribute("aria-label", "Search events");
text.setAttribute("aria-label", "Note at this time");
speed.setAttribute("aria-label", "Speed");
found.hidden = true;
for (const s of SPEEDS) speed.append(new Option(`${s}×`, s, s === 1, s === 1));
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
let state = { position_s: 0, playing: false, speed: 1, problem: "" };
let dragging = false;

function send(action, value = 0, words = "") {
  if (socket?.readyState === WebSocket.OPEN) {
    socket.send(JSON.stringify({ action, value, text: words }));
  }
}

function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}/review/ws`);
  socket.onmessage = (event) => {
    state = JSON.parse(event.data);
    if (state.version !== version) load(state.version);
    render();
  };
  socket.onclose = () => setTimeout(connect, 500);
}

async function load(next) {
  const isFirst = session === null;
  version = next;
  session = await (await fetch("/review/session")).json();
  track.replaceChildren(done, head, tip);
  for (const m of [...session.marks, ...session.notes]) addMark(m);
  const kinds = new Set([...session.marks, ...session.notes].map((m) => (m.kind === "mark" ? "note" : m.kind)));
  legend.replaceChildren();
  for (const [kind, [word, color]] of Object.entries(KINDS)) {
    if (!kinds.has(kind)) continue;
    const item = make("span");
    const dot = make("i");
    dot.style.background = color;
    item.append(dot, word);
    legend.append(item);
  }
  sessions.hidden = !session.has_list;
  compare();
  drawStrip();
  search();
  render();
  if (isFirst) openMoment();
}

// `#t=83.2` opens that moment, in a link as well as typed into the address.
function openMoment() {
  const at = /^#t=(\d+(\.\d+)?)$/.exec(location.hash);
  if (at) send("seek", Number(at[1]));
}

const pictureOf = (at) => `/review/moment?at=${at.toFixed(1)}&v=${version}`;

function drawStrip() {
  const count = Math.max(3, Math.min(16, Math.floor(strip.clientWidth / PICTURE_PX)));
  strip.replaceChildren();
  for (let n = 0; n < count; n++) {
    const at = (session.duration_s * (n + 0.5)) / count;
    const button = make("button");
    const image = make("img");
    button.type = "button";
    button.setAttribute("aria-label", `Camera at ${clock(at)}`);
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
    const line = `${m.kind} ${KINDS[m.kind]?.[0] ?? ""} ${m.text}`.toLowerCase();
    return words.every((word) => line.includes(word));
  });
  found.replaceChildren();
  for (const m of matches.slice(0, MOST_FOUND)) {
    const line = make("li");
    const button = make("button");
    button.type = "button";
    button.append(make("b", "", clock(m.at_s)), ` ${m.text || m.kind}`);
    button.onclick = () => send("seek", m.at_s + SHOWN_AFTER_S);
    line.append(button);
    found.append(line);
  }
  const more = matches.length - MOST_FOUND;
  if (words.length > 0 && matches.length === 0) found.append(make("li", "none", "No event holds these words."));
  if (more > 0) found.append(make("li", "none", `${more} more: add a word.`));
  found.hidden = words.length === 0;
}

function addMark(m) {
  const kind = m.kind === "mark" ? "note" : m.kind;
  const button = make("button", `mark ${kind} lane${m.lane}`);
  button.type = "button";
  button.style.left = `${(100 * m.at_s) / Math.max(session.duration_s, 0.1)}%`;
  button.setAttribute("aria-label", `${clock(m.at_s)} ${m.text || kind}`);
  button.onclick = (event) => {
    event.stopPropagation();
    // Seek slightly past the event, so that its effect is visible.
    send("seek", m.at_s + SHOWN_AFTER_S);
  };
  button.onpointerdown = (event) => event.stopPropagation();
  button.onpointerenter = () => show(m.at_s, `${clock(m.at_s)}  ${m.text || kind}`);
  button.onpointerleave = () => (tip.hidden = true);
  track.append(button);
}

function compare() {
  versus.replaceChildren();
  if (session.sessions.length < 2) return;
  const columns = ["", "object", "outcome", "time", "path", "explored", "best match"];
  const row = versus.createTHead().insertRow();
  for (const name of columns) row.append(make("th", "", name));
  const body = versus.createTBody();
  for (const [n, s] of session.sessions.entries()) {
    const cells = [
      `${n === 0 ? "● left" : "■ right"}  ${s.name}`, s.object, s.outcome, clock(s.duration_s),
      `${s.path_length_m.toFixed(1)} m`, `${s.explored_m2.toFixed(1)} m²`, `${Math.round(100 * s.best_ooi)} %`,
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
  play.textContent = state.playing ? "Pause" : "Play";
  if (document.activeElement !== speed) speed.value = state.speed;
  time.replaceChildren(clock(state.position_s), make("small", "", ` / ${clock(session.duration_s)}`));
  // A file that is still being written is incomplete; do not report that as a problem.
  const problem = state.problem || (state.growing ? "" : session.problems.join("; "));
  const first = session.sessions[0];
  const live = state.growing ? "recording in progress – " : "";
  const ended = state.ended ? "end of the recording – " : "";
  said.textContent = problem || (first ? `${live || ended}${first.name}${first.context ? ` – “${first.context}”` : ""}` : "");
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
  send("note", 0, text.value.trim());
  text.value = "";
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
  history.replaceState(null, "", `#t=${state.position_s.toFixed(1)}`);
  try {
    await navigator.clipboard.writeText(url);
    link.textContent = "Copied";
  } catch {
    // Without permission to the clipboard, the address line holds the link.
    link.textContent = "In the address";
  }
  setTimeout(() => (link.textContent = "Link"), 2000);
};
window.addEventListener("hashchange", openMoment);
let resized = 0;
window.addEventListener("resize", () => {
  clearTimeout(resized);
  resized = setTimeout(() => session && drawStrip(), 300);
});
sessions.onclick = () => (location.href = "/sessions");
sessions.hidden = true;

// Handles keys before the shell does: there Space stops the robot, here it plays and pauses.
function onKey(event) {
  if (event.target?.closest?.("input, textarea, select")) return;
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const keys = {
    Space: toggle,
    Comma: () => send("step", -1),
    Period: () => send("step", 1),
    ArrowLeft: () => send("seek", state.position_s - 5),
    ArrowRight: () => send("seek", state.position_s + 5),
    Home: () => send("seek", 0),
  };
  const act = keys[event.code];
  if (act === undefined) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  act();
}

const view = document.getElementById("view");
const adopt = () => view.contentWindow?.addEventListener("keydown", onKey, true);
window.addEventListener("keydown", onKey, true);
view.addEventListener("load", adopt);
adopt();
connect();

// The list of sessions: filter, open one, compare two.

import { decimal, has, say } from "/assets/words.js";

const at = (id) => document.getElementById(id);
const SHOWN = 120;
const chosen = new Set();
let all = [];

const make = (tag, name, text) => {
  const node = document.createElement(tag);
  if (name) node.className = name;
  if (text !== undefined) node.textContent = text;
  return node;
};
const clock = (s) => `${Math.floor(s / 60)}:${String(Math.floor(s % 60)).padStart(2, "0")}`;
const outcomeOf = (word) => (has(`outcome.${word}`) ? say(`outcome.${word}`) : word);

function card(s) {
  const link = make("a", "card-of-session");
  link.href = `/session/${encodeURIComponent(s.id)}`;
  const picture = s.picture_bytes > 0 ? make("img") : make("div", "none", say(s.problem ? "sessions.unreadable" : "sessions.no_picture"));
  if (s.picture_bytes > 0) {
    picture.src = `/review/picture/${encodeURIComponent(s.id)}`;
    picture.alt = "";
    picture.loading = "lazy";
  }
  const body = make("div", "body");
  const top = make("div", "top");
  top.append(make("span", "", s.object.replaceAll("_", " ") || s.id), make("span", `outcome ${s.outcome}`, outcomeOf(s.outcome)));
  if (s.problem) {
    body.append(top, make("div", "problem", s.problem));
  } else {
    const figures = `${s.when}  ·  ${clock(s.duration_s)}  ·  ${decimal(s.path_length_m, 1)} m`;
    body.append(
      top, make("div", "context", s.context || say("sessions.no_context")), make("div", "figures", figures),
      make("div", "figures", s.robot),
    );
  }
  const label = make("label", "", "");
  const box = make("input");
  box.type = "checkbox";
  box.checked = chosen.has(s.id);
  box.setAttribute("aria-label", say("sessions.compare"));
  label.onclick = (event) => event.stopPropagation();
  box.onchange = () => {
    box.checked ? chosen.add(s.id) : chosen.delete(s.id);
    at("compare").disabled = chosen.size !== 2;
  };
  label.append(box, ` ${say("sessions.compare")}`);
  link.append(picture, body, label);
  return link;
}

function render() {
  const words = at("words").value.toLowerCase().split(/\s+/).filter(Boolean);
  const outcome = at("outcome").value;
  const fit = all.filter((s) => {
    const text = `${s.id} ${s.object} ${s.context} ${s.robot} ${s.when} ${s.outcome}`.toLowerCase();
    return (outcome === "" || s.outcome === outcome) && words.every((w) => text.includes(w));
  });
  at("cards").replaceChildren(...fit.slice(0, SHOWN).map(card));
  at("count").textContent = say(fit.length > SHOWN ? "sessions.count.first" : "sessions.count", {
    fit: fit.length, all: all.length, shown: SHOWN,
  });
}

async function load() {
  const list = await (await fetch("/review/sessions")).json();
  all = list.sessions;
  at("where").textContent = list.folder;
  const outcomes = [...new Set(all.map((s) => s.outcome).filter(Boolean))].sort();
  for (const word of outcomes) at("outcome").append(new Option(outcomeOf(word), word));
  render();
}

at("words").oninput = render;
at("outcome").onchange = render;
at("compare").onclick = () => {
  const [a, b] = [...chosen].sort();
  location.href = `/session/${encodeURIComponent(a)}?beside=${encodeURIComponent(b)}`;
};
load();

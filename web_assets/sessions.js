// The list of sessions: filter, open one, compare two.

import { chosenTheme, light } from "/assets/theme.js";
import { decimal, say } from "/assets/words.js";
import { outcomeOf, sumOf } from "/review/outcomes.js";

const at = (id) => document.getElementById(id);
const SHOWN = 120;
const chosen = new Set();
let all = [];

const paint = () => {
  document.documentElement.dataset.theme = chosenTheme();
};
light.addEventListener("change", paint);
addEventListener("storage", paint);
paint();

const make = (tag, name, text) => {
  const node = document.createElement(tag);
  if (name) node.className = name;
  if (text !== undefined) node.textContent = text;
  return node;
};
const clock = (s) => `${Math.floor(s / 60)}:${String(Math.floor(s % 60)).padStart(2, "0")}`;

function card(s) {
  const link = make("a", "card-of-session");
  link.href = `/session/${encodeURIComponent(s.id)}`;
  link.title = s.id;
  const picture = s.picture_bytes > 0 ? make("img") : make("div", "none", say(s.problem ? "sessions.unreadable" : "sessions.no_picture"));
  if (s.picture_bytes > 0) {
    picture.src = `/review/picture/${encodeURIComponent(s.id)}`;
    picture.alt = "";
    picture.loading = "lazy";
  }
  const body = make("div", "body");
  const top = make("div", "top");
  const sum = sumOf(s.goals);
  top.append(make("span", "", sum.objects || s.id), make("span", `outcome ${sum.word}`, sum.outcome));
  if (s.problem) {
    body.append(top, make("div", "problem", s.problem));
  } else {
    const figures = `${s.when}  ·  ${clock(s.duration_s)}  ·  ${decimal(s.path_length_m, 1)} m`;
    body.append(
      top, make("div", "context", sum.context || say("sessions.no_context")), make("div", "figures", figures),
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
    const sum = sumOf(s.goals);
    const labels = s.goals.map((goal) => goal.object).join(" ");
    const text = `${s.id} ${sum.objects} ${labels} ${sum.context} ${s.robot} ${s.when} ${sum.outcome}`.toLowerCase();
    return (outcome === "" || s.goals.some((goal) => goal.outcome === outcome)) && words.every((w) => text.includes(w));
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
  const outcomes = [...new Set(all.flatMap((s) => s.goals.map((goal) => goal.outcome)))].sort();
  for (const word of outcomes) at("outcome").append(new Option(outcomeOf(word), word));
  render();
}

at("words").oninput = render;
at("outcome").onchange = render;
at("compare").onclick = () => {
  const [a, b] = [...chosen].sort();
  location.href = `/session/${encodeURIComponent(a)}?beside=${encodeURIComponent(b)}`;
};
load().catch(() => (at("count").textContent = say("link.silence.sentence")));

// The card that explains a clicked surface or viewpoint. Sets text only, never markup.

import { BASE } from "./base.js";
import { say } from "./words.js";

const at = (id) => document.getElementById(id);

export class Explanation {
  constructor() {
    this.shown = "";
    this.number = 0;
    this.closed = 0;
    at("explanation-close").addEventListener("click", () => this.close());
  }

  close() {
    this.closed = this.number;
    at("explanation").hidden = true;
  }

  // Escape closes the card, unless something that is open before it takes the key.
  onKey(event) {
    if (event.key !== "Escape" || !at("explanation").checkVisibility()) return;
    if (document.querySelector("dialog[open], body[data-side]")) return;
    // The introduction stays open until the next one.
    event.stopImmediatePropagation();
    this.close();
  }

  update(explanation) {
    const key = JSON.stringify(explanation ?? null);
    if (key === this.shown) return;
    // What was explained before this page was opened is not this person's question.
    if (this.shown === "") this.closed = explanation?.number ?? 0;
    this.shown = key;
    this.number = explanation?.number ?? 0;
    // A console that was started again counts from the beginning.
    if (this.number < this.closed) this.closed = 0;
    at("explanation").hidden = !explanation || this.number === this.closed;
    if (!explanation) return;
    at("explanation-title").textContent = explanation.title;
    at("explanation-note").textContent = explanation.note;
    at("explanation-rows").replaceChildren(...explanation.rows.flatMap(row));
    at("explanation-pictures").replaceChildren(...explanation.pictures.map(picture));
  }
}

function row([name, value]) {
  const term = document.createElement("dt");
  const text = document.createElement("dd");
  term.textContent = name;
  text.textContent = value;
  const percent = /^([0-9.,]+)\s?%$/.exec(value);
  if (percent) {
    const bar = document.createElement("i");
    bar.style.setProperty("width", `${Math.min(100, Number(percent[1].replace(",", ".")))}%`);
    text.append(bar);
  }
  return [term, text];
}

function picture({ name, caption }) {
  const figure = document.createElement("figure");
  const image = document.createElement("img");
  const text = document.createElement("figcaption");
  image.src = `${BASE}api/pictures/${encodeURIComponent(name)}`;
  image.alt = say("explain.picture", { caption });
  text.textContent = caption;
  figure.append(image, text);
  return figure;
}

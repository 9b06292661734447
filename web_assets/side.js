// Panels over the left of the scene, of which one is open: goals, things, calls.

const at = (id) => document.getElementById(id);

export class Sides {
  // isTyping: whether a key goes to a text field.
  constructor(isTyping) {
    this.isTyping = isTyping;
    this.panels = new Map();
    this.open = null;
  }

  // key: code of the key that opens the panel; onChange: told whether it is open.
  add(name, key, onChange) {
    this.panels.set(name, { key, onChange });
    for (const button of document.querySelectorAll(`[data-opens="${name}"]`)) {
      button.addEventListener("click", () => this.toggle(name));
    }
    at(`${name}-close`).addEventListener("click", () => this.toggle(name));
    at(name).addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.preventDefault();
      event.stopPropagation();
      this.toggle(name);
    });
  }

  toggle(name) {
    const before = this.open;
    if (before === null) this.opener = document.activeElement;
    this.open = before === name ? null : name;
    for (const [one, { onChange }] of this.panels) {
      const isOpen = one === this.open;
      at(one).hidden = !isOpen;
      for (const button of document.querySelectorAll(`[data-opens="${one}"]`)) {
        button.setAttribute("aria-pressed", String(isOpen));
      }
      if (isOpen || one === before) onChange(isOpen);
    }
    document.body.toggleAttribute("data-side", this.open !== null);
    if (this.open !== null) at(this.open).querySelector("[data-first]").focus();
    else this.leave();
  }

  // A hidden field would take the next key for itself: the focus is where it was.
  leave() {
    document.activeElement?.blur();
    if (this.opener?.checkVisibility()) this.opener.focus({ preventScroll: true });
  }

  // A recording calls nobody, knows no other robots and holds no memory of things.
  isMissing(name) {
    return document.body.classList.contains("review") && ["calls", "robots", "things"].includes(name);
  }

  onKey(event) {
    if (this.isTyping(event.target) || event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.repeat || document.querySelector("dialog[open]") !== null) return;
    const closes = event.key === "Escape" && !event.target.closest?.("form");
    const found = [...this.panels].find(([name, { key }]) =>
      closes ? name === this.open : key === event.code);
    if (found === undefined || this.isMissing(found[0])) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    this.toggle(found[0]);
  }
}

export function make(tag, name, text) {
  const node = document.createElement(tag);
  if (name) node.className = name;
  if (text !== undefined) node.textContent = text;
  return node;
}

export function button(text, label, act) {
  const node = make("button", "", text);
  node.type = "button";
  node.setAttribute("aria-label", label);
  if (label !== text) node.title = label;
  node.addEventListener("click", act);
  return node;
}

// Puts nodes into a list. Those that stay are not moved while their order is the same: a node that is
// moved loses the focus, which is kept, and a press that is under way, which is lost. A row that was
// made anew, with the data-row of the one before, has the focus at the same button.
export function replaceRows(list, nodes) {
  const held = list.contains(document.activeElement) ? document.activeElement : null;
  const stay = new Set(nodes);
  for (const node of [...list.children]) if (!stay.has(node)) node.remove();
  for (const [n, node] of nodes.entries()) {
    if (list.children[n] !== node) list.insertBefore(node, list.children[n] ?? null);
  }
  if (list.contains(document.activeElement)) return;
  (held?.isConnected ? held : held && successor(list, held))?.focus({ preventScroll: true });
}

function successor(list, held) {
  const { row } = held.closest("[data-row]")?.dataset ?? {};
  const now = [...list.children].find((node) => row !== undefined && node.dataset.row === row);
  const buttons = [...(now?.querySelectorAll("button") ?? [])].filter((one) => !one.hidden);
  return buttons.find((one) => one.textContent === held.textContent) ?? buttons[0];
}

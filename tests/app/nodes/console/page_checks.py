"""What can be measured of a page: names for screen readers, contrast, and what is cut off.

Each is a function in the page that takes a document and returns what is wrong, as texts.
"""

_COMMON = """
const shown = (e) => e.checkVisibility({ checkOpacity: true, checkVisibilityCSS: true })
  && e.getClientRects().length > 0;
const CONTROLS = "button, a[href], input:not([type=hidden]), select, textarea, summary, "
  + "[tabindex='0'], [role=button], [role=switch], [role=tab], [role=checkbox], [role=slider]";
const told = (e) => [
  `${e.tagName.toLowerCase()}#${e.id}.${e.className}`, e.textContent.trim().slice(0, 40),
].join(" ");
"""

UNNAMED = (
    "(doc) => {"
    + _COMMON
    + """
  const textOf = (e) => {
    if (e.getAttribute?.("aria-hidden") === "true") return "";
    if (e.nodeType === 3) return e.data;
    return e.alt ?? [...e.childNodes].map(textOf).join(" ");
  };
  const nameOf = (e) => {
    const by = (e.getAttribute("aria-labelledby") ?? "").split(/\\s+/).filter(Boolean)
      .map((id) => doc.getElementById(id)?.textContent ?? "").join(" ");
    const labels = [...(e.labels ?? [])].map(textOf).join(" ");
    const own = e.matches("input, select, textarea") ? "" : textOf(e);
    return [by, e.getAttribute("aria-label"), labels, own, e.title].map((t) => (t ?? "").trim())
      .find((t) => /[\\p{L}\\d]/u.test(t)) ?? "";
  };
  const areas = "dialog, [role=dialog], [role=alertdialog], [role=img], iframe, nav, aside";
  const roles = `${CONTROLS}, ${areas}`;
  return [...doc.querySelectorAll(roles)].filter(shown).filter((e) => nameOf(e) === "").map(told);
}"""
)

LOW_CONTRAST = (
    "(doc) => {"
    + _COMMON
    + """
  const context = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
  const parsed = new Map();
  const rgba = (css) => {
    if (!parsed.has(css)) {
      context.clearRect(0, 0, 1, 1);
      context.fillStyle = css;
      context.fillRect(0, 0, 1, 1);
      const [r, g, b, a] = context.getImageData(0, 0, 1, 1).data;
      parsed.set(css, [r, g, b, a / 255]);
    }
    return parsed.get(css);
  };
  const over = ([r, g, b, a], under) =>
    [r, g, b].map((value, n) => value * a + under[n] * (1 - a));
  const light = (rgb) => {
    const [r, g, b] = rgb.map((v) => v / 255)
      .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ground = (e) => {
    const layers = [];
    for (let one = e; one; one = one.parentElement) {
      const color = rgba(doc.defaultView.getComputedStyle(one).backgroundColor);
      layers.push(color);
      if (color[3] === 1) break;
    }
    const page = rgba("canvas").slice(0, 3);
    return layers.reverse().reduce((under, layer) => over(layer, under), page);
  };
  const wrong = new Set();
  const SILENT = "script, style, noscript, canvas, text, [aria-hidden=true], "
    + ":disabled, [data-disabled]";
  const walker = doc.createTreeWalker(doc.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const e = walker.currentNode.parentElement;
    if (!/[\\p{L}\\d]/u.test(walker.currentNode.data) || !shown(e)) continue;
    if (e.closest(SILENT)) continue;
    const style = doc.defaultView.getComputedStyle(e);
    const under = ground(e);
    let alpha = 1;
    for (let one = e; one; one = one.parentElement) {
      alpha *= Number(doc.defaultView.getComputedStyle(one).opacity);
    }
    const [r, g, b, a] = rgba(style.color);
    const [x, y] = [light(over([r, g, b, a * alpha], under)), light(under)].sort((p, q) => q - p);
    const ratio = (x + 0.05) / (y + 0.05);
    const size = parseFloat(style.fontSize);
    const isLarge = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    if (ratio < (isLarge ? 3 : 4.5) - 0.005) {
      wrong.add(`${ratio.toFixed(2)} ${told(e)} ${style.color} on ${under.map(Math.round)}`);
    }
  }
  return [...wrong];
}"""
)

CUT_OFF = (
    "(doc) => {"
    + _COMMON
    + """
  const wrong = [];
  const isCut = (e) => e.clientWidth > 0 && e.scrollWidth > e.clientWidth + 1;
  const [wide, high] = [doc.documentElement.clientWidth, doc.documentElement.clientHeight];
  const top = [...doc.querySelectorAll("dialog[open]")].at(-1);
  for (const e of [...doc.querySelectorAll(CONTROLS)].filter(shown)) {
    if (top && !top.contains(e)) continue;
    // Rooms lie on the plan, which is moved to reach them.
    if (e.matches("#plan-rooms button, input[type=checkbox], [role=slider]")) continue;
    e.scrollIntoView({ block: "center", inline: "nearest" });
    const box = e.getBoundingClientRect();
    const isIn = box.left >= -1 && box.top >= -1 && box.right <= wide + 1 && box.bottom <= high + 1;
    const hit = doc.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);
    const isHit = hit !== null && (e.contains(hit) || hit.contains(e));
    const isShort = isCut(e) && e.matches("button, summary");
    if (!isIn && (box.width <= wide && box.height <= high)) wrong.push(`outside: ${told(e)}`);
    else if (!isHit) wrong.push(`covered by ${hit && told(hit)}: ${told(e)}`);
    else if (isShort) wrong.push(`cut off: ${told(e)}`);
  }
  for (const e of doc.querySelectorAll(".chip, h1, h2, .notice strong, .notice span")) {
    const box = e.getBoundingClientRect();
    if (!shown(e) || top) continue;
    if (box.left < -1 || box.right > wide + 1 || isCut(e)) {
      wrong.push(`cut off: ${told(e)}`);
    }
    // Its own text, all of it, is what is seen there.
    const hit = doc.elementFromPoint(box.right - 6, box.top + box.height / 2);
    if (e.matches(".chip") && !(hit && e.contains(hit))) wrong.push(`covered: ${told(e)}`);
  }
  return wrong;
}"""
)


def in_page(page, check):
    """Return what a check finds in the page around the scene."""
    return page.evaluate(f"({check})(document)")


def in_panels(page, check):
    """Return what a check finds in the panels beside the scene."""
    return page.evaluate(f"({check})(document.getElementById('view').contentDocument)")

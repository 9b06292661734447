// Scrolls the reply to a button press into view.

const RECENT_MS = 10000;

export function showAnswers(inner) {
  let pressedAt = -Infinity;
  inner.addEventListener("click", () => (pressedAt = performance.now()), true);
  new MutationObserver((changes) => {
    if (performance.now() - pressedAt > RECENT_MS) return;
    for (const node of changes.flatMap((change) => [...change.addedNodes])) {
      if (node.classList?.contains("ip-answer")) node.scrollIntoView({ block: "nearest" });
    }
  }).observe(inner, { childList: true, subtree: true });
}

// The name of what is under the pointer, where the map is coloured by kinds of things.

const REST_MS = 120;
const BESIDE_PX = 14;

// view: the frame of the scene; request: sends a message and returns the reply. Returns a function
// that listens to the frame's window.
export function installHover(view, request) {
  const label = document.getElementById("hover");
  let timer = 0;
  let isAsking = false;
  let turn = 0;

  const hide = () => {
    turn += 1;
    clearTimeout(timer);
    label.hidden = true;
  };

  const ask = async (x, y, u, v) => {
    if (isAsking) return;
    isAsking = true;
    const asked = turn;
    const reply = await request({ type: "hover", u, v });
    isAsking = false;
    if (asked !== turn || !reply?.text) return;
    label.textContent = reply.text;
    label.hidden = false;
    const frame = view.getBoundingClientRect();
    const right = Math.min(frame.left + x + BESIDE_PX, innerWidth - label.offsetWidth - 4);
    label.style.setProperty("left", `${right}px`);
    label.style.setProperty("top", `${frame.top + y + BESIDE_PX}px`);
  };

  return (inner) => {
    inner.addEventListener("pointermove", (event) => {
      hide();
      if (event.pointerType !== "mouse" || event.buttons || event.target.tagName !== "CANVAS") return;
      const box = event.target.getBoundingClientRect();
      const [x, y] = [event.clientX, event.clientY];
      const [u, v] = [(x - box.left) / box.width, (y - box.top) / box.height];
      if (u < 0 || u > 1 || v < 0 || v > 1) return;
      timer = setTimeout(() => ask(x, y, u, v), REST_MS);
    });
    for (const kind of ["pointerdown", "pointerout", "wheel", "keydown"]) {
      inner.addEventListener(kind, hide, { passive: true });
    }
  };
}

// Mouse, fingers and wheel on the plan: one drags or clicks, two zoom as well.

const CLICK_PX = 4;
const LINE_PX = 33;
const PER_PX = 0.0014;
const MOST_PX = 250;

// plan: size, center, move, zoom, click, world and draw of the plan that the canvas shows.
export function followPointer(canvas, plan) {
  const pressed = new Map();
  let isDragged = false;
  const end = (event) => pressed.delete(event.pointerId);

  canvas.addEventListener("pointerdown", (event) => {
    // Other buttons are for menus.
    if (plan.size !== "full" || event.button !== 0 || pressed.size === 2) return;
    // Two fingers zoom; what they release is no click.
    isDragged = pressed.size === 1;
    pressed.set(event.pointerId, [event.clientX, event.clientY]);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!pressed.has(event.pointerId) || plan.center === null) return;
    // A menu may have swallowed the release.
    if ((event.buttons & 1) === 0) {
      end(event);
      return;
    }
    const to = [event.clientX, event.clientY];
    if (!isDragged && distance(pressed.get(event.pointerId), to) < CLICK_PX) return;
    isDragged = true;
    const before = held(pressed);
    pressed.set(event.pointerId, to);
    const now = held(pressed);
    plan.move((before.x - now.x) / plan.scale, (now.y - before.y) / plan.scale);
    if (before.apart > 0 && now.apart > 0) plan.zoom(now.apart / before.apart, at(now));
  });
  canvas.addEventListener("pointerup", (event) => {
    const isClick = pressed.has(event.pointerId) && !isDragged && event.button === 0;
    end(event);
    if (isClick && plan.center !== null) plan.click(plan.world(event));
  });
  for (const type of ["pointercancel", "lostpointercapture"]) canvas.addEventListener(type, end);
  canvas.addEventListener("click", () => plan.size === "corner" && plan.resize("full"));
  canvas.addEventListener("wheel", (event) => {
    if (plan.size !== "full" || plan.center === null) return;
    event.preventDefault();
    const px = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PX : 1);
    plan.zoom(Math.exp(-PER_PX * Math.max(-MOST_PX, Math.min(MOST_PX, px))), plan.world(event));
  }, { passive: false });

  const at = ({ x, y }) => plan.world({ clientX: x, clientY: y });
}

const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

// The middle of the pointers that are down, and how far two are apart.
function held(pressed) {
  const [a, b = a] = [...pressed.values()];
  return { x: (a[0] + b[0]) / 2, y: (a[1] + b[1]) / 2, apart: distance(a, b) };
}

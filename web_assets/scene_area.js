// Measures which part of the page is the scene, so that what is drawn over it does not cover the panel.

export function followSceneArea(view, onChange) {
  const main = view.parentElement;
  let known = "";
  const measure = () => {
    const whole = main.getBoundingClientRect();
    const panel = view.contentDocument
      ?.querySelector("[data-dock-region='right']")
      ?.getBoundingClientRect();
    let [right, bottom] = [0, 0];
    if (panel && panel.width > 0 && panel.height > 0) {
      const isBelow = panel.width > 0.9 * whole.width;
      if (isBelow) bottom = Math.max(0, whole.height - panel.top);
      else right = Math.max(0, whole.width - panel.left);
    }
    const size = `${Math.round(whole.width)} ${Math.round(whole.height)}`;
    const now = `${Math.round(right)} ${Math.round(bottom)} ${size}`;
    if (now === known) return;
    known = now;
    document.body.style.setProperty("--scene-right", `${Math.round(right)}px`);
    document.body.style.setProperty("--scene-bottom", `${Math.round(bottom)}px`);
    onChange();
  };
  setInterval(measure, 300);
  measure();
}

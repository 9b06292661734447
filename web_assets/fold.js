// A tablet held upright has the panel below the map: folded it leaves the map all but its tabs.

const at = (id) => document.getElementById(id);

export function installFold(view) {
  const button = at("fold");
  const fold = (folded) => {
    document.body.toggleAttribute("data-folded", folded);
    const word = folded ? "Open the panel" : "Fold the panel";
    button.title = word;
    button.setAttribute("aria-label", word);
    button.textContent = folded ? "▴" : "▾";
    view.contentDocument?.documentElement.toggleAttribute("data-ip-folded", folded);
  };
  const isFolded = () => document.body.hasAttribute("data-folded");
  // A tab that is pressed is wanted, folded or not.
  const adopt = () => {
    fold(isFolded());
    view.contentDocument?.addEventListener("click", (event) => {
      if (isFolded() && event.target.closest?.('[role="tab"]')) fold(false);
    });
  };
  button.addEventListener("click", () => fold(!isFolded()));
  view.addEventListener("load", adopt);
  adopt();
}

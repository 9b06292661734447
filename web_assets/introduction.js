// Five steps for whoever opens the console for the first time. It covers no control and blocks none.

const KEY = "ippon-introduction";
const DONE = "done";
const STEPS = [
  {
    tab: "Search",
    title: "Search",
    text: "Write what you look for and where you think it is, as you would say it: “my hat, I think it is on the sofa”. Press Search and the robot starts.",
  },
  {
    tab: "Map",
    title: "Why it goes there",
    text: "Click anything in the scene: the page says what it is, how likely the object is there, and why the robot goes to a viewpoint. The Map tab has the colours and their meaning.",
  },
  {
    tab: "Drive",
    title: "Steer",
    text: "Here you choose what a click does: send the robot there, or say look here and not here. Assisted and Manual let you drive with W A S D. Space stops the robot at any time.",
  },
  {
    tab: "Search",
    title: "Confirm",
    text: "The robot stops in front of what it found and shows its picture here. Confirm it, or reject it and the search goes on.",
  },
  {
    tab: "Session",
    title: "Review",
    text: "Each session is recorded. Mark moments and write notes here; afterwards play it with: ippon review",
  },
];

const at = (id) => document.getElementById(id);

export class Introduction {
  constructor(view) {
    this.view = view;
    this.box = at("introduction");
    at("introduction-next").addEventListener("click", () => this.go(this.step + 1));
    at("introduction-back").addEventListener("click", () => this.go(this.step - 1));
    at("introduction-end").addEventListener("click", () => this.go(STEPS.length));
    at("introduction-again").addEventListener("click", () => {
      at("help").close();
      this.go(0);
    });
    this.box.addEventListener("keydown", (event) => event.key === "Escape" && this.go(STEPS.length));
    const kept = localStorage.getItem(KEY);
    this.step = kept === DONE ? STEPS.length : Number(kept ?? 0);
    this.begun = false;
  }

  // Begin once there is something to see.
  begin() {
    if (this.begun) return;
    this.begun = true;
    if (this.step < STEPS.length) this.go(this.step, false);
  }

  go(step, hasAsked = true) {
    this.begun = true;
    this.step = Math.max(0, step);
    const one = STEPS[this.step];
    localStorage.setItem(KEY, one ? String(this.step) : DONE);
    this.box.hidden = one === undefined;
    if (one === undefined) return;
    at("introduction-title").textContent = one.title;
    at("introduction-text").textContent = one.text;
    at("introduction-count").textContent = `${this.step + 1} of ${STEPS.length}`;
    at("introduction-back").disabled = this.step === 0;
    at("introduction-next").textContent = this.step + 1 < STEPS.length ? "Next" : "Done";
    if (!hasAsked) return;
    this.open(one.tab);
    at("introduction-next").focus();
  }

  open(name) {
    const tabs = this.view.contentDocument?.querySelectorAll('[role="tab"]') ?? [];
    const tab = [...tabs].find((one) => one.textContent.trim() === name);
    // viser's tabs can be dragged: they are pressed by a pointer, not by a click.
    for (const kind of ["pointerdown", "pointerup", "click"]) {
      tab?.dispatchEvent(new PointerEvent(kind, { bubbles: true, isPrimary: true, pointerId: 1 }));
    }
  }
}

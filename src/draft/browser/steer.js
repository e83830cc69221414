// Commands from sliders, keys and gamepads; a change of any is heard by one listener.

const DEAD = 0.15, LEFT_SHOULDER = 4, RIGHT_SHOULDER = 5; // As in `serving/gamepad.js`.
const KEYS = /** @type {Record<string, [number, number]>} */ ({
  ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [2, 1], ArrowRight: [2, -1],
  w: [0, 1], s: [0, -1], a: [2, 1], d: [2, -1], q: [1, 1], e: [1, -1],
});

export class Steering {
  /**
   * @param {HTMLInputElement[]} sliders forward [m/s], left [m/s] and turn [rad/s]
   * @param {{push: (side: number) => void, changed: () => void}} heard
   */
  constructor(sliders, heard) {
    this.sliders = sliders;
    this.heard = heard;
    this.pad = { axes: [0, 0, 0], push: 0, used: false };
    addEventListener("keydown", (event) => this.key(event));
    for (const slider of sliders) slider.addEventListener("input", () => heard.changed());
  }

  /** Commanded forward, left [m/s] and turn [rad/s]. */
  get command() {
    return this.sliders.map((slider) => Number(slider.value));
  }

  /** @param {number[]} values */
  set command(values) {
    values.forEach((value, i) => { this.sliders[i].value = String(value); });
    this.heard.changed();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = /** @type {HTMLElement} */ (event.target);
    const typed = /** @type {HTMLInputElement} */ (target).type;
    if (["TEXTAREA", "SELECT"].includes(target.tagName) || typed === "text") return;
    if (target.tagName === "INPUT" && event.key.startsWith("Arrow")) return; // It moves the slider.
    if (event.key === " " && target.tagName !== "BUTTON" && target.tagName !== "SUMMARY") this.command = [0, 0, 0];
    else if (event.key === "p") this.heard.push(1);
    else if (event.key in KEYS) {
      const [axis, way] = KEYS[event.key], slider = this.sliders[axis];
      slider.value = String(Number(slider.value) + way * Number(slider.max) / 8);
      this.heard.changed();
    } else return;
    event.preventDefault();
  }

  /** Read the first gamepad, which steers as long as its sticks move. */
  poll() {
    const pad = [...(navigator.getGamepads?.() ?? [])].find((one) => one?.connected && one.mapping === "standard");
    if (!pad) return;
    const lean = (/** @type {number} */ value) =>
      Math.sign(value) * Math.min(1, Math.max(0, Math.abs(value) - DEAD) / (1 - DEAD));
    const axes = [-lean(pad.axes[1]), -lean(pad.axes[0]), -lean(pad.axes[2])];
    const pressed = (/** @type {number} */ index) => Number(Boolean(pad.buttons[index]?.pressed));
    const push = pressed(RIGHT_SHOULDER) - pressed(LEFT_SHOULDER);
    if (push && push !== this.pad.push) this.heard.push(push);
    const moved = axes.some((value) => value !== 0);
    if (moved || this.pad.used) this.command = axes.map((value, i) => value * Number(this.sliders[i].max));
    this.pad = { axes, push, used: moved };
  }
}

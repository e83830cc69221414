// Loads of a robot's joints in the last second, below the lines of their motors.

const KEPT = 1, EVERY = 2; // Time that loads are kept [s]; pictures of the page per drawing.

export class Limits {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    /** @type {{time: number, joint: number, speed: number, torque: number}[]} */
    this.loads = [];
    this.count = 0;
  }

  /** Forget the loads, as of another robot or body. */
  clear() {
    this.loads = [];
  }

  /**
   * Remember the loads of now: shares of the no-load speed and of the peak torque.
   * @param {any} robot
   */
  add(robot) {
    const { numbers: p, data: { time } } = robot;
    robot.v.forEach((/** @type {number} */ at, /** @type {number} */ joint) => this.loads.push({
      time, joint, speed: Math.abs(robot.qvel[at]) / p.no_load_speed[joint],
      torque: Math.abs(robot.torque[joint]) / p.peak_torque[joint],
    }));
    const first = this.loads.findIndex((one) => one.time > time - KEPT);
    if (first > 0) this.loads.splice(0, first);
  }

  /**
   * Draw them, and return the joint with the highest torque.
   * @param {any} robot
   * @returns {string}
   */
  draw(robot) {
    if (this.count++ % EVERY || !robot.policy) return "";
    const { canvas, pen } = this, { width, height } = canvas, left = 30, low = height - 20;
    const x = (/** @type {number} */ speed) => left + (width - left - 6) * Math.min(speed, 1.2) / 1.2;
    const y = (/** @type {number} */ torque) => low - (low - 6) * torque;
    pen.clearRect(0, 0, width, height);
    pen.strokeStyle = "#8c959f";
    pen.fillStyle = "#57606a";
    pen.font = "11px system-ui, sans-serif";
    for (const [text, speed, torque] of [["0", 0, 0], ["½", 0.5, 0], ["no-load speed", 0.82, 0]])
      pen.fillText(String(text), x(Number(speed)) - 3, low + 14);
    pen.fillText("peak", 0, 14);
    pen.fillText("0", 16, low + 3);
    const lines = new Map(); // Motors of one class have one line.
    robot.numbers.peak_torque.forEach((/** @type {number} */ peak, /** @type {number} */ i) =>
      lines.set((robot.numbers.stall_torque[i] / peak).toFixed(3), robot.numbers.stall_torque[i] / peak));
    for (const stall of lines.values()) {
      pen.beginPath();
      pen.moveTo(x(0), y(1));
      pen.lineTo(x(1 - 1 / stall), y(1));
      pen.lineTo(x(1), y(0));
      pen.stroke();
    }
    pen.strokeStyle = "#d0d7de";
    pen.strokeRect(left, 6, width - left - 6, low - 6);
    let most = 0, busiest = 0;
    for (const { joint, speed, torque } of this.loads) {
      const over = torque > 0.999 || torque >= 0.999 * (robot.numbers.stall_torque[joint] / robot.numbers.peak_torque[joint]) * (1 - speed);
      pen.fillStyle = over ? "#d1242f" : "#33608f88";
      pen.fillRect(x(speed) - 1, y(Math.min(torque, 1)) - 1, 2.5, 2.5);
      if (torque > most) { most = torque; busiest = joint; }
    }
    return `${robot.policy.joints[busiest].replaceAll("_", " ")}: up to ${(100 * most).toFixed(0)} % of its peak torque`;
  }
}

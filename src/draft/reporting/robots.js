// Robots of a report at one scale: recorded gaits over marks on the floor, or home poses.
import * as THREE from "three";
import { Figure } from "draft/figure";
import { unpack } from "draft/packed";
import { View } from "draft/view";

const MARKS = 64; // Most marks below a robot.
const $ = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

/** A robot with the frames of its gait, of which a standing one has one. */
class Recorded {
  /**
   * @param {View} view
   * @param {any} robot record of `draft.reporting.scene3d`
   * @param {number} mark distance between two marks [m]
   */
  constructor(view, robot, mark) {
    this.robot = robot;
    this.mark = mark;
    this.frames = robot.frames;
    this.places = unpack(robot.positions);
    this.turns = unpack(robot.quaternions);
    this.travel = robot.travel ? unpack(robot.travel) : null;
    // The world is body 0.
    this.positions = new Float64Array(3 * (robot.bodies + 1));
    this.quaternions = new Float64Array(4 * (robot.bodies + 1));
    this.figure = new Figure(view.scene, robot.geoms, robot.color, 1);
    if (!this.travel) return;
    this.lines = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: robot.color }));
    this.lines.geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(6 * MARKS), 3));
    this.lines.frustumCulled = false;
    view.scene.add(this.lines);
  }

  /** @param {number} time [s] */
  pose(time) {
    const { robot, frames } = this, at = this.travel ? time / robot.period : 0;
    const round = Math.floor(at / frames), first = Math.floor(at) % frames, next = (first + 1) % frames;
    const share = at - Math.floor(at);
    for (let body = 0; body < robot.bodies; body++) {
      const a = first * robot.bodies + body, b = next * robot.bodies + body;
      const from = this.turns.subarray(4 * a, 4 * a + 4), to = this.turns.subarray(4 * b, 4 * b + 4);
      let dot = 0, square = 0;
      for (let k = 0; k < 4; k++) dot += from[k] * to[k];
      const q = 4 * (body + 1), p = 3 * (body + 1);
      for (let k = 0; k < 4; k++) {
        this.quaternions[q + k] = (1 - share) * from[k] + share * Math.sign(dot || 1) * to[k];
        square += this.quaternions[q + k] ** 2;
      }
      for (let k = 0; k < 4; k++) this.quaternions[q + k] /= Math.sqrt(square);
      for (let k = 0; k < 3; k++)
        this.positions[p + k] = robot.quantum * ((1 - share) * this.places[3 * a + k] + share * this.places[3 * b + k]);
    }
    this.figure.pose(this.positions, this.quaternions);
    if (this.travel) this.pass(round * robot.stride + this.travel[first]);
  }

  /**
   * Marks on the floor that pass below the robot.
   * @param {number} travel distance walked [m]
   */
  pass(travel) {
    const { mark } = this, { at, ahead, half } = this.robot;
    const lines = /** @type {THREE.LineSegments} */ (this.lines), { position } = lines.geometry.attributes;
    const long = 0.9 * (half[0] * ahead[0] + half[1] * ahead[1]), wide = 0.3 * (half[0] * ahead[1] + half[1] * ahead[0]);
    let count = 0;
    for (let s = -long + (mark - (travel % mark)) % mark; s <= long && count < 2 * MARKS; s += mark)
      for (const side of [-wide, wide])
        position.setXYZ(count++, at[0] + s * ahead[0] - side * ahead[1], at[1] + s * ahead[1] + side * ahead[0], 0.003);
    lines.geometry.setDrawRange(0, count);
    position.needsUpdate = true;
  }
}

class Scene {
  constructor() {
    const data = JSON.parse($("draft-robots").textContent);
    this.view = new View($("robots-view"), { square: data.square, box: data.box });
    this.view.pitch = 0.22;
    this.view.changed = () => this.draw();
    this.robots = data.robots.map((/** @type {any} */ one) => new Recorded(this.view, one, data.mark));
    this.labels = data.robots.map((/** @type {any} */ { label, color, at }) => {
      const text = document.createElement("span");
      text.textContent = label;
      text.style.color = color;
      $("robots-view").append(text);
      return { text, place: new THREE.Vector3(data.front, at[1], 0) };
    });
    this.time = 0;
    this.last = 0;
    this.playing = false;
    this.pending = 0; // Number of the next picture that was asked for.
    this.visible = true;
    this.draw();
    if ($("walk-play")) this.controls();
  }

  controls() {
    $("walk-play").addEventListener("click", () => this.play(!this.playing));
    $("walk-speed").addEventListener("input", () => { $("walk-shown").textContent = `${Number($("walk-speed").value).toFixed(1)} ×`; });
    new IntersectionObserver(([entry]) => { this.visible = entry.isIntersecting; }).observe($("robots-view"));
    addEventListener("beforeprint", () => this.play(false));
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play(true);
  }

  /** Draw the robots as they are at `time`. */
  draw() {
    this.robots.forEach((/** @type {Recorded} */ one) => one.pose(this.time));
    this.view.draw();
    for (const { text, place } of this.labels) {
      const { x, y } = place.clone().project(this.view.camera);
      text.style.left = `${50 * (x + 1)}%`;
      text.style.top = `${50 * (1 - y)}%`;
    }
  }

  /** @param {boolean} on */
  play(on) {
    $("walk-play").textContent = on ? "Pause" : "Play";
    this.last = performance.now();
    cancelAnimationFrame(this.pending);
    this.playing = on;
    if (on) this.pending = requestAnimationFrame((now) => this.frame(now));
  }

  /** @param {number} now [ms] */
  frame(now) {
    const gone = (now - this.last) / 1000;
    this.last = now;
    this.time += Math.max(0, Math.min(gone, 0.1)) * Number($("walk-speed").value);
    if (this.visible) {
      this.view.pace(gone);
      this.draw();
    }
    this.pending = requestAnimationFrame((next) => this.frame(next));
  }
}

try {
  Object.assign(window, { draftRobots: new Scene() }); // For tests and measurements.
} catch (error) {
  const { message } = /** @type {Error} */ (error);
  console.warn(error);
  $("robots-view").textContent = /WebGL/i.test(message)
    ? "This browser offers no WebGL, which the picture of the robots needs." : `The robots cannot be drawn here: ${message}`;
}

// Robots side by side on one ground, seen by a camera that follows them.
import * as THREE from "three";
import { Figure } from "draft/figure";
import { View } from "draft/view";

export class Picture extends View {
  /** @param {HTMLElement} place */
  constructor(place) {
    super(place);
    /** @type {Figure[]} */
    this.figures = [];
    /** @type {any[]} */
    this.robots = [];
    /** @type {number[]} */
    this.lanes = [];
  }

  /**
   * Draw these robots from now on.
   * @param {any[]} robots
   * @param {string[]} colors of their trunks
   * @param {number[]} lanes their places to the left [m]
   */
  show(robots, colors, lanes) {
    this.figures.forEach((one) => one.remove());
    this.figures = robots.map((robot, i) => new Figure(this.scene, robot.model, colors[i], robot.trunk));
    this.figures.forEach((one, i) => { one.group.position.y = lanes[i]; });
    Object.assign(this, { robots, lanes });
    this.yaw = robots.length > 1 ? 0.55 : -1.15; // Those abreast are seen from ahead, the first one nearest.
    this.size = Math.max(...robots.map((robot) => robot.size), (Math.max(...lanes) - Math.min(...lanes)) * 0.62);
    this.fade(12 * this.size, 45 * this.size);
    this.follow(true);
  }

  /**
   * Look at the robots where they are now.
   * @param {boolean} at_once without gliding
   */
  follow(at_once = false) {
    const middle = new THREE.Vector3();
    this.robots.forEach((robot, i) => {
      const at = 3 * robot.trunk;
      middle.add(new THREE.Vector3(robot.xpos[at], robot.xpos[at + 1] + this.lanes[i], robot.height));
    });
    middle.divideScalar(this.robots.length || 1);
    if (at_once || this.target.distanceTo(middle) > 3 * this.size) this.target.copy(middle);
    else this.target.lerp(middle, 0.12);
  }

  /** Draw one picture of where the robots are. */
  draw() {
    this.figures.forEach((one, i) => one.pose(this.robots[i].xpos, this.robots[i].xquat));
    super.draw();
  }
}

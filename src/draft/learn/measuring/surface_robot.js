// The body of the design under the pointer, all at one scale.
import { Figure } from "draft/figure";
import { unpack } from "draft/packed";
import { View } from "draft/view";

const place = /** @type {HTMLElement} */ (document.getElementById("robot"));

class Robot {
  /** @param {any} bodies record of `draft.learn.measuring.surface_page` */
  constructor({ geoms, names, rows }) {
    this.names = names;
    this.rows = rows.map((/** @type {any} */ row) => row && unpack(row));
    const bodies = Math.max(...geoms.geom_bodyid) + 1;
    this.sizes = names.map((/** @type {string} */ name) =>
      name === "xpos" ? 3 * bodies : name === "xquat" ? 4 * bodies : geoms[name].length);
    const model = { ...geoms }, places = this.rows.filter(Boolean).map((/** @type {any} */ row) => this.fields(row));
    this.view = new View(place, { square: 0.2, box: box(places) });
    this.view.yaw = 0.9;
    this.view.changed = () => this.view.draw();
    this.model = model;
    this.figure = new Figure(this.view.scene, model, "", 1);
    this.show(this.rows.findIndex(Boolean));
    addEventListener("design", (event) => this.show(/** @type {CustomEvent} */ (event).detail));
  }

  /**
   * Numbers of a body by name.
   * @param {Float32Array} row
   */
  fields(row) {
    let at = 0;
    return Object.fromEntries(this.names.map((/** @type {string} */ name, /** @type {number} */ i) =>
      [name, row.subarray(at, (at += this.sizes[i]))]));
  }

  /** @param {number} i design */
  show(i) {
    const row = this.rows[i];
    this.figure.group.visible = Boolean(row);
    if (row) {
      const { xpos, xquat, ...shapes } = this.fields(row);
      Object.assign(this.model, shapes);
      this.figure.shape();
      this.figure.pose(xpos, xquat);
    }
    this.view.draw();
  }
}

/**
 * Box around the origins of all bodies, with room for what is around them.
 * @param {Record<string, Float32Array>[]} places
 * @returns {[number[], number[]]}
 */
function box(places) {
  const low = [0, 0, 0], high = [0, 0, 0];
  for (const { xpos } of places)
    xpos.forEach((value, i) => { low[i % 3] = Math.min(low[i % 3], value); high[i % 3] = Math.max(high[i % 3], value); });
  const room = 0.15 * Math.max(...high.map((value, k) => value - low[k]));
  return [[low[0] - room, low[1] - room, 0], high.map((value) => value + room)];
}

try {
  // @ts-ignore: a constant of the page's first script.
  if (BODIES) Object.assign(window, { draftRobot: new Robot(BODIES) }); // For tests.
  else place.remove();
} catch (error) {
  console.warn(error);
  place.remove(); // The numbers do not need it.
}

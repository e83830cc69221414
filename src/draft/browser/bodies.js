// Bodies under sliders: numbers at the nodes of a grid, interpolated between them (`grid.py`).

/**
 * @typedef {object} Vary
 * @property {{name: string, unit: string, nodes: number[], value: number}[]} sliders
 * @property {Record<string, number[]>} columns indices of the numbers that vary, by field
 * @property {number} components
 * @property {{mass: number, inertia: number, length: number}} errors largest between nodes
 * @property {any[]} said what Draft says of each node
 */

export class Bodies {
  /**
   * @param {Vary} vary
   * @param {Float32Array} numbers means, components, and coefficients of the nodes
   */
  constructor(vary, numbers) {
    this.vary = vary;
    this.names = Object.keys(vary.columns);
    this.count = this.names.reduce((sum, name) => sum + vary.columns[name].length, 0);
    this.mean = numbers.subarray(0, this.count);
    this.parts = numbers.subarray(this.count, this.count * (1 + vary.components));
    this.shares = numbers.subarray(this.count * (1 + vary.components));
  }

  /**
   * Corners of the cell that holds these values, with their weights, the largest first.
   * @param {number[]} values of the sliders, within their ranges
   * @returns {[number, number][]} node and weight
   */
  corners(values) {
    let found = /** @type {[number, number][]} */ ([[0, 1]]);
    this.vary.sliders.forEach(({ nodes }, axis) => {
      let low = 0;
      while (low < nodes.length - 2 && values[axis] >= nodes[low + 1]) low++;
      const share = Math.min(1, Math.max(0, (values[axis] - nodes[low]) / (nodes[low + 1] - nodes[low])));
      found = found.flatMap(([node, weight]) => /** @type {[number, number][]} */ ([
        [node * nodes.length + low, weight * (1 - share)], [node * nodes.length + low + 1, weight * share]]));
    });
    return found.filter(([, weight]) => weight > 1e-9).sort((a, b) => b[1] - a[1]);
  }

  /**
   * Numbers of the body at these values.
   * @param {number[]} values of the sliders
   * @returns {{columns: Record<string, Float64Array>, said: any, between: boolean}} numbers by field,
   *   what is said of the nearest node, and whether the body lies between nodes
   */
  at(values) {
    const corners = this.corners(values), { components } = this.vary;
    const all = Float64Array.from(this.mean);
    for (let k = 0; k < components; k++) {
      const share = corners.reduce((sum, [node, weight]) => sum + weight * this.shares[node * components + k], 0);
      for (let i = 0, at = k * this.count; i < this.count; i++) all[i] += share * this.parts[at + i];
    }
    let at = 0;
    const columns = Object.fromEntries(this.names.map((name) =>
      [name, all.subarray(at, (at += this.vary.columns[name].length))]));
    return { columns, said: this.vary.said[corners[0][0]], between: corners.length > 1 };
  }
}

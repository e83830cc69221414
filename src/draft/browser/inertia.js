// Inertia tensors of bodies from principal moments and axes, and back by Jacobi's rotations.

/**
 * @param {ArrayLike<number>} tensors xx, yy, zz, xy, xz, yz of each body [kg m2]
 * @param {Float64Array} moments of each body, greatest first
 * @param {Float64Array} turns unit quaternions (w, x, y, z) of the principal axes
 */
export function principal(tensors, moments, turns) {
  for (let body = 0; 6 * body < tensors.length; body++) {
    const [xx, yy, zz, xy, xz, yz] = [0, 1, 2, 3, 4, 5].map((k) => tensors[6 * body + k]);
    const a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    for (let sweep = 0; sweep < 12; sweep++) {
      for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
        if (Math.abs(a[p][q]) <= 1e-18 * (Math.abs(a[p][p]) + Math.abs(a[q][q]))) continue;
        const theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const t = Math.sign(theta || 1) / (Math.abs(theta) + Math.hypot(theta, 1));
        const c = 1 / Math.hypot(t, 1), s = t * c;
        for (const row of a) [row[p], row[q]] = [c * row[p] - s * row[q], s * row[p] + c * row[q]];
        [a[p], a[q]] = [a[p].map((x, k) => c * x - s * a[q][k]), a[q].map((x, k) => s * a[p][k] + c * x)];
        for (const row of axes) [row[p], row[q]] = [c * row[p] - s * row[q], s * row[p] + c * row[q]];
      }
    }
    const order = [0, 1, 2].sort((i, j) => a[j][j] - a[i][i]);
    const [x, y, z] = order.map((k) => axes.map((row) => row[k]));
    const [u, v, w] = [y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0]];
    const hand = Math.sign(x[0] * u + x[1] * v + x[2] * w);
    moments.set(order.map((k) => a[k][k]), 3 * body);
    turns.set(quaternion(x.map((k) => k * hand), y, z), 4 * body);
  }
}

/**
 * Unit quaternion of the rotation with these columns.
 * @param {number[]} x
 * @param {number[]} y
 * @param {number[]} z
 */
function quaternion(x, y, z) {
  const four = [1 + x[0] + y[1] + z[2], 1 + x[0] - y[1] - z[2], 1 - x[0] + y[1] - z[2], 1 - x[0] - y[1] + z[2]];
  const largest = four.indexOf(Math.max(...four)), r = 2 * Math.sqrt(four[largest]);
  const [a, b, c] = [y[2] - z[1], z[0] - x[2], x[1] - y[0]], [d, e, f] = [x[1] + y[0], z[0] + x[2], y[2] + z[1]];
  const rows = [[r * r / 4, a, b, c], [a, r * r / 4, d, e], [b, d, r * r / 4, f], [c, e, f, r * r / 4]];
  return rows[largest].map((value) => value / r);
}

/**
 * Inertia tensors of principal moments and axes; the reverse of `principal`.
 * @param {ArrayLike<number>} moments
 * @param {ArrayLike<number>} turns
 */
export function tensors(moments, turns) {
  const found = new Float64Array(2 * moments.length);
  for (let body = 0; 3 * body < moments.length; body++) {
    const [w, x, y, z] = [0, 1, 2, 3].map((k) => turns[4 * body + k]);
    const r = [
      [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
      [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
      [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ];
    const entry = (/** @type {number} */ i, /** @type {number} */ j) =>
      [0, 1, 2].reduce((sum, k) => sum + r[i][k] * r[j][k] * moments[3 * body + k], 0);
    found.set([entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)], 6 * body);
  }
  return found;
}

/**
 * Bring quaternions to unit length.
 * @param {Float64Array} turns
 */
export function unit(turns) {
  for (let i = 0; i < turns.length; i += 4) {
    const length = Math.hypot(turns[i], turns[i + 1], turns[i + 2], turns[i + 3]);
    for (let k = i; k < i + 4; k++) turns[k] /= length;
  }
}

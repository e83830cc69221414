// A robot from the geoms of its MuJoCo model: one mesh per body, and its shadow on the ground.
import * as THREE from "three";

export const SUN = new THREE.Vector3(0.35, -0.45, 1);
const SHADE = new THREE.MeshBasicMaterial({ color: 0xa9b2ba, depthWrite: false });
const SKIN = new THREE.MeshLambertMaterial({ vertexColors: true });
const SPHERE = 2, CYLINDER = 5, BOX = 6, MESH = 7; // of mjtGeom
const UNIT = /** @type {Record<number, THREE.BufferGeometry>} */ ({
  [SPHERE]: new THREE.SphereGeometry(1, 16, 10),
  [CYLINDER]: new THREE.CylinderGeometry(1, 1, 2, 24).rotateX(Math.PI / 2),
  [BOX]: new THREE.BoxGeometry(2, 2, 2),
});
for (const type in UNIT) UNIT[type] = UNIT[type].toNonIndexed();
// Projection along the sun's rays on the ground.
const FLAT = new THREE.Matrix4().set(
  1, 0, -SUN.x / SUN.z, 0, 0, 1, -SUN.y / SUN.z, 0, 0, 0, 0, 0, 0, 0, 0, 1);

/**
 * @typedef {object} Geoms geoms and meshes by the names of MjModel, see `draft.drawing.geoms`
 * @property {number} ngeom
 * @property {ArrayLike<number>} geom_type
 * @property {ArrayLike<number>} geom_size
 * @property {ArrayLike<number>} geom_pos
 * @property {ArrayLike<number>} geom_quat
 * @property {ArrayLike<number>} geom_bodyid
 * @property {ArrayLike<number>} geom_dataid
 * @property {ArrayLike<number>} geom_rgba
 * @property {ArrayLike<number>} mesh_vert
 * @property {ArrayLike<number>} mesh_vertadr
 * @property {ArrayLike<number>} mesh_face
 * @property {ArrayLike<number>} mesh_faceadr
 * @property {ArrayLike<number>} mesh_facenum
 */

export class Figure {
  /**
   * @param {THREE.Scene} scene
   * @param {Geoms} model
   * @param {string} color of the trunk, "" for that of the model
   * @param {number} trunk its body
   */
  constructor(scene, model, color, trunk) {
    this.scene = scene;
    this.model = model;
    this.color = color;
    this.trunk = trunk;
    this.group = new THREE.Group();
    /** @type {Map<number, {geoms: number[], mesh: THREE.Mesh, shadow: THREE.Mesh}>} */
    this.parts = new Map();
    for (let geom = 0; geom < model.ngeom; geom++) {
      const type = model.geom_type[geom], body = model.geom_bodyid[geom];
      if (model.geom_rgba[4 * geom + 3] === 0) continue; // It only collides, or has an inertia.
      if (type !== MESH && !UNIT[type]) continue;
      if (!this.parts.has(body)) {
        const shape = new THREE.BufferGeometry();
        const mesh = new THREE.Mesh(shape, SKIN), shadow = new THREE.Mesh(shape, SHADE);
        mesh.matrixAutoUpdate = shadow.matrixAutoUpdate = false;
        mesh.frustumCulled = shadow.frustumCulled = false;
        shadow.renderOrder = -0.5; // Above the ground, below all else.
        this.group.add(mesh, shadow);
        this.parts.set(body, { geoms: [], mesh, shadow });
      }
      this.parts.get(body)?.geoms.push(geom);
    }
    scene.add(this.group);
    this.shape();
  }

  /** Take the shapes of the model, which may have changed, anew. */
  shape() {
    for (const { geoms, mesh } of this.parts.values()) {
      const solids = geoms.map((geom) => this.solid(geom));
      const count = solids.reduce((sum, one) => sum + one.points.length, 0);
      const points = new Float32Array(count), normals = new Float32Array(count), colors = new Float32Array(count);
      let at = 0;
      for (const one of solids) {
        points.set(one.points, at);
        normals.set(one.normals, at);
        for (const end = at + one.points.length; at < end; at += 3) colors.set(one.rgb, at);
      }
      Object.entries({ position: points, normal: normals, color: colors }).forEach(([name, values]) =>
        mesh.geometry.setAttribute(name, new THREE.BufferAttribute(values, 3)));
    }
  }

  /**
   * Triangles of a geom in the frame of its body.
   * @param {number} geom
   * @returns {{points: Float32Array, normals: Float32Array, rgb: number[]}}
   */
  solid(geom) {
    const { model } = this, type = model.geom_type[geom], s = 3 * geom, q = 4 * geom;
    const color = new THREE.Color();
    if (this.color && type === MESH && model.geom_bodyid[geom] === this.trunk) color.set(this.color);
    else color.setRGB(model.geom_rgba[q], model.geom_rgba[q + 1], model.geom_rgba[q + 2], THREE.SRGBColorSpace);
    const a = model.geom_size[s];
    const scale = type === SPHERE ? [a, a, a] : type === CYLINDER ? [a, a, model.geom_size[s + 1]]
      : type === BOX ? [a, model.geom_size[s + 1], model.geom_size[s + 2]] : [1, 1, 1];
    const turn = new THREE.Quaternion(
      model.geom_quat[q + 1], model.geom_quat[q + 2], model.geom_quat[q + 3], model.geom_quat[q]);
    const place = new THREE.Vector3(model.geom_pos[s], model.geom_pos[s + 1], model.geom_pos[s + 2]);
    const own = type === MESH ? this.faces(model.geom_dataid[geom]) : UNIT[type].attributes.position.array;
    const points = Float32Array.from(own);
    const normals = type === MESH ? new Float32Array(points.length) : Float32Array.from(UNIT[type].attributes.normal.array);
    if (type === MESH) flat(points, normals);
    const one = new THREE.Vector3();
    for (let i = 0; i < points.length; i += 3) {
      one.set(points[i] * scale[0], points[i + 1] * scale[1], points[i + 2] * scale[2]).applyQuaternion(turn).add(place).toArray(points, i);
      one.fromArray(normals, i).applyQuaternion(turn).toArray(normals, i);
    }
    return { points, normals, rgb: color.toArray() };
  }

  /**
   * Corners of the triangles of a mesh, one after another.
   * @param {number} mesh
   */
  faces(mesh) {
    const { model } = this, vertex = model.mesh_vertadr[mesh], face = model.mesh_faceadr[mesh];
    const found = new Float32Array(9 * model.mesh_facenum[mesh]);
    const vertices = model.mesh_vert, faces = model.mesh_face;
    for (let i = 0; i < found.length / 3; i++) {
      const from = 3 * (vertex + faces[3 * face + i]);
      for (let k = 0; k < 3; k++) found[3 * i + k] = vertices[from + k];
    }
    return found;
  }

  /**
   * Move the bodies.
   * @param {ArrayLike<number>} positions of the bodies [m], as xpos
   * @param {ArrayLike<number>} quaternions of the bodies (w, x, y, z), as xquat
   */
  pose(positions, quaternions) {
    for (const [body, { mesh, shadow }] of this.parts) {
      const p = 3 * body, q = 4 * body;
      mesh.matrix.compose(
        PLACE.set(positions[p], positions[p + 1], positions[p + 2]),
        TURN.set(quaternions[q + 1], quaternions[q + 2], quaternions[q + 3], quaternions[q]), ONE);
      shadow.matrix.multiplyMatrices(FLAT, mesh.matrix);
    }
  }

  remove() {
    this.scene.remove(this.group);
    for (const { mesh } of this.parts.values()) mesh.geometry.dispose();
  }
}

const PLACE = new THREE.Vector3(), TURN = new THREE.Quaternion(), ONE = new THREE.Vector3(1, 1, 1);

/**
 * Normals of flat triangles.
 * @param {Float32Array} points corners of the triangles
 * @param {Float32Array} normals theirs, which are set
 */
function flat(points, normals) {
  const a = new THREE.Vector3(), b = new THREE.Vector3(), c = new THREE.Vector3();
  for (let i = 0; i < points.length; i += 9) {
    a.fromArray(points, i);
    b.fromArray(points, i + 3).sub(a);
    c.fromArray(points, i + 6).sub(a);
    b.cross(c).normalize();
    for (let k = 0; k < 9; k += 3) b.toArray(normals, i + k);
  }
}

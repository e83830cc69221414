// Robots on a checked ground, drawn by three.js from the geoms of their MuJoCo models.
import * as THREE from "three";

const SKY = 0xe4eaf0, LIGHT = "#d4d9dd", DARK = "#c6ccd2", SHADE = 0xa9b2ba;
const SUN = new THREE.Vector3(0.35, -0.45, 1);
const SLOW = 0.045, TRIED = 12; // Time of a picture that is too long [s]; pictures before a change.
const LEAST = 0.5; // Least resolution, per pixel of the screen.
const TRUNK = 1; // Its body: the world comes first.
const SPHERE = 2, CYLINDER = 5, BOX = 6, MESH = 7; // of mjtGeom
const UNIT = {
  [SPHERE]: new THREE.SphereGeometry(1, 20, 14),
  [CYLINDER]: new THREE.CylinderGeometry(1, 1, 2, 28).rotateX(Math.PI / 2),
  [BOX]: new THREE.BoxGeometry(2, 2, 2),
};

/** A robot as meshes. */
class Figure {
  /**
   * @param {THREE.Scene} scene
   * @param {any} robot
   * @param {string} color of the trunk, "" for that of the model
   * @param {number} lane place of the robot to the left [m]
   */
  constructor(scene, robot, color, lane) {
    this.robot = robot;
    this.lane = lane;
    this.group = new THREE.Group();
    this.group.position.y = lane;
    /** @type {[number, THREE.Mesh, THREE.Mesh][]} */
    this.parts = [];
    const { model } = robot, shade = new THREE.MeshBasicMaterial({ color: SHADE });
    for (let geom = 0; geom < model.ngeom; geom++) {
      if (model.geom_rgba[4 * geom + 3] === 0) continue; // It only collides, or has an inertia.
      const type = model.geom_type[geom];
      if (type !== MESH && !UNIT[type]) continue;
      const rgb = new THREE.Color();
      if (type === MESH && model.geom_bodyid[geom] === TRUNK && color) rgb.set(color);
      else rgb.setRGB(model.geom_rgba[4 * geom], model.geom_rgba[4 * geom + 1], model.geom_rgba[4 * geom + 2], THREE.SRGBColorSpace);
      const shape = type === MESH ? new THREE.BufferGeometry() : UNIT[type];
      const mesh = new THREE.Mesh(shape, new THREE.MeshLambertMaterial({ color: rgb, flatShading: type === MESH }));
      const shadow = new THREE.Mesh(shape, shade);
      mesh.matrixAutoUpdate = shadow.matrixAutoUpdate = false;
      mesh.frustumCulled = shadow.frustumCulled = false;
      this.group.add(mesh, shadow);
      this.parts.push([geom, mesh, shadow]);
    }
    scene.add(this.group);
    this.shape();
  }

  /** Take the shape of the robot's body anew: the trunk's mesh, as sizes are read in each picture. */
  shape() {
    const { model } = this.robot;
    for (const [geom, mesh] of this.parts) {
      if (model.geom_type[geom] !== MESH) continue;
      const id = model.geom_dataid[geom], vertex = model.mesh_vertadr[id], face = model.mesh_faceadr[id];
      const points = model.mesh_vert.slice(3 * vertex, 3 * (vertex + model.mesh_vertnum[id]));
      mesh.geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(points), 3));
      mesh.geometry.setIndex([...model.mesh_face.slice(3 * face, 3 * (face + model.mesh_facenum[id]))]);
      mesh.geometry.computeVertexNormals();
    }
  }

  /** Move the parts to where the robot is. */
  pose() {
    const { model, geom_xpos: p, geom_xmat: m } = this.robot, sizes = model.geom_size;
    for (const [geom, mesh, shadow] of this.parts) {
      const type = model.geom_type[geom], at = 3 * geom, o = 9 * geom;
      let a = 1, b = 1, c = 1;
      if (type === SPHERE) a = b = c = sizes[at];
      else if (type === CYLINDER) { a = b = sizes[at]; c = sizes[at + 1]; }
      else if (type === BOX) { a = sizes[at]; b = sizes[at + 1]; c = sizes[at + 2]; }
      mesh.matrix.set(
        m[o] * a, m[o + 1] * b, m[o + 2] * c, p[at], m[o + 3] * a, m[o + 4] * b, m[o + 5] * c, p[at + 1],
        m[o + 6] * a, m[o + 7] * b, m[o + 8] * c, p[at + 2], 0, 0, 0, 1);
      shadow.matrix.multiplyMatrices(FLAT, mesh.matrix);
    }
  }

  /** @param {THREE.Scene} scene */
  remove(scene) {
    scene.remove(this.group);
  }
}

// Projection along the sun's rays on the ground, a little above it.
const FLAT = new THREE.Matrix4().set(
  1, 0, -SUN.x / SUN.z, 0, 0, 1, -SUN.y / SUN.z, 0, 0, 0, 0, 0.002, 0, 0, 0, 1);

export class Picture {
  /**
   * @param {HTMLElement} place
   * @throws {Error} if the browser has no WebGL
   */
  constructor(place) {
    this.place = place;
    this.renderer = new THREE.WebGLRenderer({ antialias: !drawnInSoftware(), powerPreference: "low-power" });
    this.sharpness = Math.min(devicePixelRatio, 2); // Pixels drawn per pixel of the page.
    this.slow = 0; // Pictures that took too long.
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(SKY);
    this.camera = new THREE.PerspectiveCamera(38, 1, 0.02, 200);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa3ab, 2.1));
    const sun = new THREE.DirectionalLight(0xffffff, 1.7);
    sun.position.copy(SUN);
    this.scene.add(sun, sun.target);
    this.ground = ground();
    this.scene.add(this.ground);
    /** @type {Figure[]} */
    this.figures = [];
    this.yaw = 0; // Angles of the view [rad], and distance per size.
    this.pitch = 0.28;
    this.away = 1;
    this.target = new THREE.Vector3();
    place.append(this.renderer.domElement);
    this.drag();
    new ResizeObserver(() => this.resize()).observe(place);
    this.resize();
  }

  /**
   * Draw these robots from now on.
   * @param {any[]} robots
   * @param {string[]} colors
   * @param {number[]} lanes
   */
  show(robots, colors, lanes) {
    this.figures.forEach((one) => one.remove(this.scene));
    this.figures = robots.map((robot, i) => new Figure(this.scene, robot, colors[i], lanes[i]));
    this.yaw = robots.length > 1 ? -0.55 : -1.15; // Those abreast are seen from ahead.
    this.size = Math.max(...robots.map((robot) => robot.size), (Math.max(...lanes) - Math.min(...lanes)) * 0.75);
    this.scene.fog = new THREE.Fog(SKY, 12 * this.size, 45 * this.size);
    this.follow(true);
  }

  /**
   * Look at the robots where they are now.
   * @param {boolean} at_once without gliding
   */
  follow(at_once = false) {
    const middle = new THREE.Vector3(), count = this.figures.length || 1;
    for (const { robot, lane } of this.figures) {
      const at = 3 * robot.trunk;
      middle.add(new THREE.Vector3(robot.xpos[at], robot.xpos[at + 1] + lane, robot.height));
    }
    middle.divideScalar(count);
    if (at_once || this.target.distanceTo(middle) > 3 * this.size) this.target.copy(middle);
    else this.target.lerp(middle, 0.12);
  }

  /**
   * Draw coarser pictures where they take too long, as without a graphics card.
   * @param {number} seconds since the last picture
   */
  pace(seconds) {
    this.slow = seconds > SLOW ? this.slow + 1 : 0;
    if (this.slow < TRIED || this.sharpness <= LEAST) return;
    this.slow = 0;
    this.sharpness = Math.max(LEAST, this.sharpness * 0.75);
    this.resize();
  }

  /** Draw one picture. */
  draw() {
    this.figures.forEach((one) => one.pose());
    const distance = 2.6 * this.size * this.away * Math.max(1, 1.25 / this.camera.aspect);
    const flat = Math.cos(this.pitch) * distance;
    this.camera.position.set(
      this.target.x + flat * Math.cos(this.yaw), this.target.y + flat * Math.sin(this.yaw),
      Math.max(0.05, this.target.z + Math.sin(this.pitch) * distance));
    this.camera.lookAt(this.target);
    const tile = this.ground.userData.tile; // The ground moves with the view by whole squares.
    this.ground.position.set(tile * Math.round(this.target.x / tile), tile * Math.round(this.target.y / tile), 0);
    this.renderer.render(this.scene, this.camera);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.place;
    this.renderer.setPixelRatio(this.sharpness);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / Math.max(height, 1);
    this.camera.updateProjectionMatrix();
  }

  /** Turn by dragging, move nearer and away by the wheel. */
  drag() {
    const { domElement: canvas } = this.renderer;
    let held = false;
    canvas.addEventListener("pointerdown", (event) => { held = true; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointerup", () => { held = false; });
    canvas.addEventListener("pointercancel", () => { held = false; });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      this.yaw -= 0.008 * event.movementX;
      this.pitch = Math.min(1.5, Math.max(0.02, this.pitch + 0.006 * event.movementY));
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.away = Math.min(4, Math.max(0.25, this.away * Math.exp(0.001 * event.deltaY)));
    }, { passive: false });
  }
}

/** Whether the browser draws without a graphics card, which makes smooth edges slow. */
function drawnInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl");
  const known = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = gl && known ? gl.getParameter(known.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(name);
}

/** A ground of squares of half a metre. */
function ground() {
  const tiles = document.createElement("canvas");
  tiles.width = tiles.height = 2;
  const pen = /** @type {CanvasRenderingContext2D} */ (tiles.getContext("2d"));
  pen.fillStyle = LIGHT;
  pen.fillRect(0, 0, 2, 2);
  pen.fillStyle = DARK;
  pen.fillRect(0, 0, 1, 1);
  pen.fillRect(1, 1, 1, 1);
  const texture = new THREE.CanvasTexture(tiles);
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  texture.repeat.set(200, 200);
  texture.magFilter = THREE.NearestFilter;
  texture.colorSpace = THREE.SRGBColorSpace;
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(200, 200), new THREE.MeshBasicMaterial({ map: texture }));
  mesh.userData.tile = 1;
  return mesh;
}

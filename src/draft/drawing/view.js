// A view of robots on a checked ground: camera, light, and dragging.
import * as THREE from "three";
import { SUN } from "draft/figure";

const SKY = 0xe4eaf0, LIGHT = 0xd4d9dd, DARK = 0xc6ccd2;
const SLOW = 0.045, TRIED = 12; // Time of a picture that is too long [s]; pictures before a change.
const LEAST = 0.5; // Least resolution, per pixel of the screen.
const FAR = 200; // Width of a ground without an end [m].
const FILLED = 0.92; // Share of the view that what it fits to fills.

export class View {
  /**
   * @param {HTMLElement} place
   * @param {{square?: number, box?: [number[], number[]]}} options width of the ground's squares
   *   [m]; box that a view without perspective fits to, on a ground that ends around it
   * @throws {Error} if the browser has no WebGL
   */
  constructor(place, { square = 0.5, box } = {}) {
    this.place = place;
    this.renderer = new THREE.WebGLRenderer({ antialias: !drawnInSoftware(), powerPreference: "low-power" });
    this.sharpness = Math.min(devicePixelRatio, 2); // Pixels drawn per pixel of the page.
    this.slow = 0; // Pictures that took too long.
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(SKY);
    this.box = box ? new THREE.Box3(...box.map((corner) => new THREE.Vector3(...corner))) : null;
    this.camera = box ? new THREE.OrthographicCamera() : new THREE.PerspectiveCamera(38, 1, 0.02, 200);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa3ab, 2.1));
    const sun = new THREE.DirectionalLight(0xffffff, 1.7);
    sun.position.copy(SUN);
    this.scene.add(sun, sun.target);
    this.tile = 2 * square;
    this.ground = ground(square, this.box);
    this.scene.add(this.ground);
    this.yaw = 0; // Angles of the view [rad], and distance per size.
    this.pitch = 0.28;
    this.away = 1;
    this.size = 1;
    this.changed = () => {}; // Called after a view that nobody else draws again has changed.
    this.target = this.box ? this.box.getCenter(new THREE.Vector3()) : new THREE.Vector3();
    place.append(this.renderer.domElement);
    this.drag();
    new ResizeObserver(() => this.resize()).observe(place);
    this.resize();
  }

  /**
   * Let what is far away fade into the sky.
   * @param {number} near distance at which it begins [m]
   * @param {number} far distance at which nothing else is seen [m]
   */
  fade(near, far) {
    this.scene.fog = new THREE.Fog(SKY, near, far);
    this.ground.material.uniforms.near.value = near;
    this.ground.material.uniforms.far.value = far;
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
    const { camera } = this, aspect = this.place.clientWidth / Math.max(this.place.clientHeight, 1);
    const distance = this.box ? 50 : 2.6 * this.size * this.away * Math.max(1, 1.25 / aspect);
    const level = Math.cos(this.pitch) * distance, up = Math.sin(this.pitch) * distance;
    camera.position.set(
      this.target.x + level * Math.cos(this.yaw), this.target.y + level * Math.sin(this.yaw),
      Math.max(0.05, this.target.z + up));
    camera.lookAt(this.target);
    if (camera instanceof THREE.OrthographicCamera) {
      const [wide, high] = this.extent();
      const half = this.away * Math.max(high, wide / aspect) / FILLED;
      Object.assign(camera, { top: half, bottom: -half, right: half * aspect, left: -half * aspect });
    } else {
      camera.aspect = aspect;
      const { tile } = this; // The ground moves with the view by whole squares.
      this.ground.position.set(tile * Math.round(this.target.x / tile), tile * Math.round(this.target.y / tile), 0);
    }
    camera.updateProjectionMatrix();
    this.renderer.render(this.scene, camera);
  }

  /**
   * Half of the width and height of the box as it is seen from where the view starts [m].
   * @returns {[number, number]}
   */
  extent() {
    if (!this.seen) {
      this.camera.updateMatrixWorld();
      const size = /** @type {THREE.Box3} */ (this.box).getSize(new THREE.Vector3());
      const along = [0, 1].map((k) => new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, k));
      this.seen = along.map(({ x, y, z }) => (Math.abs(x * size.x) + Math.abs(y * size.y) + Math.abs(z * size.z)) / 2);
    }
    return /** @type {[number, number]} */ (this.seen);
  }

  resize() {
    this.renderer.setPixelRatio(this.sharpness);
    this.renderer.setSize(this.place.clientWidth, this.place.clientHeight, false);
    this.changed();
  }

  /** Turn by dragging, move nearer and away by the wheel, which scrolls past a view of a box. */
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
      this.changed();
    });
    if (this.box) return;
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

/**
 * A ground of squares, without an end or around a box. Its shader reads no texture and smooths the
 * squares by their mean over a pixel, which without a graphics card takes half of the time.
 * @param {number} square width of a square [m]
 * @param {THREE.Box3 | null} box
 */
function ground(square, box) {
  const size = box?.getSize(new THREE.Vector3()), tile = 2 * square;
  const [wide, deep] = size ? [size.x, size.y].map((one) => tile * Math.ceil(one / tile)) : [FAR, FAR];
  const material = new THREE.ShaderMaterial({
    depthWrite: false, // Shadows lie too close to it to be sorted by depth: it is drawn first.
    uniforms: {
      square: { value: square }, sky: { value: tint(SKY) }, light: { value: tint(LIGHT) }, dark: { value: tint(DARK) },
      near: { value: 1e6 }, far: { value: 2e6 }, // of the fog [m]
    },
    vertexShader: `uniform float square; varying vec2 at; varying float away;
      void main() {
        at = position.xy / square;
        vec4 seen = modelViewMatrix * vec4(position, 1.0);
        away = -seen.z;
        gl_Position = projectionMatrix * seen;
      }`,
    fragmentShader: `uniform vec3 sky, light, dark; uniform float near, far; varying vec2 at; varying float away;
      void main() {
        vec2 wide = max(fwidth(at), 1e-4);
        vec2 edge = 2.0 * (abs(fract((at - 0.5 * wide) * 0.5) - 0.5) - abs(fract((at + 0.5 * wide) * 0.5) - 0.5)) / wide;
        vec3 color = mix(light, dark, 0.5 - 0.5 * edge.x * edge.y);
        gl_FragColor = vec4(mix(color, sky, clamp((away - near) / (far - near), 0.0, 1.0)), 1.0);
      }`,
  });
  const mesh = new THREE.Mesh(new THREE.PlaneGeometry(wide, deep), material);
  mesh.renderOrder = -1;
  const middle = box?.getCenter(new THREE.Vector3());
  if (middle) mesh.position.set(middle.x, middle.y, 0);
  return mesh;
}

/**
 * A colour as a screen shows it, for a shader.
 * @param {number} hex
 */
function tint(hex) {
  return new THREE.Vector3(hex >> 16, (hex >> 8) & 255, hex & 255).divideScalar(255);
}

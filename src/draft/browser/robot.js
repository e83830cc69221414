// A robot on a plane in MuJoCo, driven by a policy: `draft.learn.policy.walk.Walk` in the browser.
// Its states, observations, actions and torques are those of the native one (tests/browser).
import { principal, tensors, unit } from "draft/inertia";

const CLEAR = 0.005, EVEN = 1e-4; // As in `walk.py`: height above the floor, depth in it [m].
const DOWN = 1.0; // Time that a fallen robot lies before it starts again [s].
// The floor is the first geom, which the grid's models, of robots alone, lack.
const START = /** @type {Record<string, number>} */ ({
  geom_size: 3, geom_pos: 3, geom_quat: 4, geom_rbound: 1, geom_aabb: 6,
});

/**
 * @typedef {object} Policy numbers of `draft.learn.policy.policy.Policy`, joints in its order
 * @property {string[]} joints
 * @property {[string, number][]} terms of an observation
 * @property {boolean[]} rolls
 * @property {number} period between two actions [s]
 * @property {number} timestep [s]
 * @property {{low: number, tilt: number}} fall share of the height at home, and tilt [rad], of a fall
 * @property {number[]} offsets of the joints at the start [rad]
 */

export class Robot {
  /**
   * @param {any} mujoco module of MuJoCo
   * @param {{xml: string, floor: string, trunk: string, size: number, height: number, policy: Policy | null}} robot
   * @param {import("draft/network").Network | null} network
   * @param {Record<string, number[]>} numbers of the body that its start and its policy need, each
   *   by joint or whole: home_position, forward, sign, home, action_scale, stiffness, damping,
   *   peak_torque, stall_torque, no_load_speed, features, trim
   */
  constructor(mujoco, robot, network, numbers) {
    this.mujoco = mujoco;
    this.policy = robot.policy;
    this.network = network;
    this.size = robot.size; // For views [m].
    this.height = robot.height;
    this.command = [0, 0, 0];
    this.falls = 0;
    this.lying = NaN; // Time since which it lies.
    this.since = 0; // Physics steps since the last action.
    this.model = mujoco.MjModel.from_xml_string(robot.xml);
    if (robot.policy) {
      this.model.opt.timestep = robot.policy.timestep;
      this.model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST.value;
      this.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION.value;
    }
    this.data = new mujoco.MjData(this.model);
    const id = (/** @type {any} */ kind, /** @type {string} */ name) => mujoco.mj_name2id(this.model, kind.value, name);
    const kinds = mujoco.mjtObj;
    this.floor = id(kinds.mjOBJ_GEOM, robot.floor);
    this.trunk = id(kinds.mjOBJ_BODY, robot.trunk);
    const joints = (robot.policy?.joints ?? []).map((name) => id(kinds.mjOBJ_JOINT, name));
    this.q = joints.map((joint) => this.model.jnt_qposadr[joint]);
    this.v = joints.map((joint) => this.model.jnt_dofadr[joint]);
    this.sensors = robot.policy ? ["imu_lin_vel", "imu_ang_vel"].map(
      (name) => this.model.sensor_adr[id(kinds.mjOBJ_SENSOR, name)]) : [];
    this.action = new Float64Array(joints.length);
    this.trimmed = new Float64Array(5); // The state of the policy's trim.
    this.torque = new Float64Array(joints.length);
    this.observation = new Float32Array(network ? network.mean.length : 0);
    this.period = robot.policy ? Math.round(robot.policy.period / robot.policy.timestep) : 1;
    this.grab();
    this.numbers = numbers;
    /** @type {Float64Array | null} Inertias of the bodies, once they vary. */
    this.tensors = null;
    this.restart();
  }

  /** Free the memory of MuJoCo, which the browser does not collect. */
  delete() {
    this.data.delete();
    this.model.delete();
  }

  /** Take the arrays of the state anew. */
  grab() {
    const { data } = this;
    this.qpos = data.qpos;
    this.qvel = data.qvel;
    this.qfrc_applied = data.qfrc_applied;
    this.sensordata = data.sensordata;
    this.xmat = data.xmat;
    this.xpos = data.xpos;
    this.xquat = data.xquat;
  }

  /** Take them anew if the memory of MuJoCo has grown, as with another robot: it detaches them. */
  refresh() {
    if (!this.qpos.length) this.grab();
  }

  /**
   * Let the body be replaced: what a model remembers of equal frames need not hold for others.
   * Vertices of the trunk then are in the frame of its body.
   * @returns {Float64Array} inertias of the bodies
   */
  loosen() {
    const { model } = this;
    for (const kind of ["body", "geom", "site"]) model[`${kind}_sameframe`].fill(0);
    model.opt.disableflags |= this.mujoco.mjtDisableBit.mjDSBL_MIDPHASE.value; // Its boxes turn.
    const found = this.tensors = tensors(model.body_inertia, model.body_iquat);
    for (let geom = 0; geom < model.ngeom; geom++) {
      // Copies of a part share their mesh, which stays.
      if (model.geom_type[geom] !== this.mujoco.mjtGeom.mjGEOM_MESH.value || model.geom_bodyid[geom] !== 1) continue;
      const mesh = model.geom_dataid[geom], start = model.mesh_vertadr[mesh];
      const [w, x, y, z] = model.geom_quat.slice(4 * geom, 4 * geom + 4), place = model.geom_pos.slice(3 * geom, 3 * geom + 3);
      for (let i = 3 * start; i < 3 * (start + model.mesh_vertnum[mesh]); i += 3) {
        const [a, b, c] = model.mesh_vert.slice(i, i + 3);
        model.mesh_vert.set([
          place[0] + (1 - 2 * (y * y + z * z)) * a + 2 * (x * y - w * z) * b + 2 * (x * z + w * y) * c,
          place[1] + 2 * (x * y + w * z) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z - w * x) * c,
          place[2] + 2 * (x * z - w * y) * a + 2 * (y * z + w * x) * b + (1 - 2 * (x * x + y * y)) * c,
        ], i);
      }
      model.geom_pos.set([0, 0, 0], 3 * geom);
      model.geom_quat.set([1, 0, 0, 0], 4 * geom);
    }
    return found;
  }

  /**
   * Replace the body, as `Walk.swap`; position, velocity, command and last action are carried over.
   * @param {Record<string, ArrayLike<number>>} columns numbers that vary, by field of MjModel or
   *   by what the start and the policy need
   * @param {Record<string, number[]>} places indices of these numbers
   */
  setBody(columns, places) {
    const { mujoco, model, data } = this;
    const turned = this.tensors ?? this.loosen();
    mujoco.mj_fwdPosition(model, data);
    const depth = this.depth(), numbers = { ...this.numbers };
    for (const [name, values] of Object.entries(columns)) {
      const put = (/** @type {any} */ to, start = 0) => places[name].forEach((at, i) => { to[start + at] = values[i]; });
      if (name.startsWith("number ")) put((numbers[name.slice(7)] = [...numbers[name.slice(7)]]));
      else if (name === "network") this.network?.put(places[name], values);
      else if (name === "body_tensor") put(turned);
      else put(model[name], START[name] ?? 0);
    }
    principal(turned, model.body_inertia, model.body_iquat);
    for (const name of ["body_quat", "geom_quat"]) if (name in columns) unit(model[name]);
    const state = { qpos: data.qpos.slice(), qvel: data.qvel.slice(), time: data.time };
    mujoco.mj_setConst(model, data);
    this.numbers = numbers;
    this.grab();
    this.qpos.set(state.qpos);
    this.qvel.set(state.qvel);
    data.time = state.time;
    mujoco.mj_forward(model, data);
    this.lift(depth, 0);
  }

  /**
   * Continue where another robot stopped, as `Walk.swap`; one of other joints starts at its place.
   * @param {Robot} other
   */
  resume(other) {
    Object.assign(this, { command: other.command, falls: other.falls });
    this.data.time = other.data.time;
    const names = (/** @type {Robot} */ one) => String(one.policy?.joints);
    const { qpos, qvel } = other.data;
    if (!this.policy || names(this) !== names(other) || qpos.length !== this.qpos.length) {
      if (this.floats && other.floats) this.qpos.set(qpos.slice(0, 2));
      this.mujoco.mj_forward(this.model, this.data);
      return;
    }
    this.mujoco.mj_fwdPosition(other.model, other.data);
    const depth = other.depth();
    this.grab();
    this.qpos.set(other.data.qpos);
    this.qvel.set(other.data.qvel);
    this.action.set(other.action);
    this.trimmed.set(other.trimmed);
    this.since = other.since;
    this.lying = other.lying;
    this.mujoco.mj_forward(this.model, this.data);
    this.lift(depth, 0);
  }

  /** Whether its base is free. */
  get floats() {
    return this.model.jnt_type.length > 0 && this.model.jnt_type[0] === 0;
  }

  /** Put the robot back to its home pose, where it stands now. */
  restart() {
    this.refresh();
    const [x, y] = this.qpos, { time } = this.data, home = this.numbers.home_position;
    const moved = this.floats;
    this.mujoco.mj_resetData(this.model, this.data);
    this.data.time = time;
    this.qpos.set(home);
    if (moved && Number.isFinite(x + y)) { this.qpos[0] = x; this.qpos[1] = y; }
    this.q.forEach((at, i) => { this.qpos[at] += this.policy?.offsets[i] ?? 0; });
    this.action.fill(0);
    this.trimmed.fill(0);
    this.torque.fill(0);
    this.since = 0;
    this.lying = NaN;
    this.mujoco.mj_forward(this.model, this.data);
    if (moved) this.lift(0, CLEAR);
  }

  /** Depth of the robot in the floor, as a standing foot has [m]. */
  depth() {
    const contacts = this.data.contact;
    let deepest = 0;
    for (let i = 0; i < contacts.size(); i++) {
      const one = contacts.get(i), pair = one.geom;
      if (pair[0] === this.floor || pair[1] === this.floor) deepest = Math.min(deepest, one.dist);
      one.delete();
    }
    contacts.delete();
    return -deepest;
  }

  /**
   * Lift the robot where it reaches deeper into the floor than allowed.
   * @param {number} allowed depth [m]
   * @param {number} clear height above it [m]
   */
  lift(allowed, clear) {
    const deeper = this.depth() - allowed;
    if (deeper <= EVEN) return;
    this.qpos[2] += deeper + clear;
    this.mujoco.mj_forward(this.model, this.data);
  }

  /** Observation of the policy, as `Controller.observe`. */
  observe() {
    this.mujoco.mj_forward(this.model, this.data);
    const { policy, numbers, qpos, qvel, sensordata, observation, q, v } = this;
    if (!policy) return observation;
    let k = 0;
    const put = (/** @type {number} */ value) => { observation[k++] = value; };
    for (const [name] of policy.terms) {
      if (name === "base_lin_vel") for (let i = 0; i < 3; i++) put(sensordata[this.sensors[0] + i]);
      else if (name === "base_ang_vel") for (let i = 0; i < 3; i++) put(sensordata[this.sensors[1] + i]);
      else if (name === "projected_gravity") for (let i = 0; i < 3; i++) put((this.trimmed[3 + i] ?? 0) - this.xmat[9 * this.trunk + 6 + i]);
      else if (name === "joint_pos") {
        for (let i = 0; i < q.length; i++) if (!policy.rolls[i]) put(numbers.sign[i] * (qpos[q[i]] - numbers.home[i]));
      } else if (name === "joint_vel") for (let i = 0; i < v.length; i++) put(numbers.sign[i] * qvel[v[i]]);
      else if (name === "actions") this.action.forEach(put);
      else if (name === "command") this.asked().forEach(put);
      else if (name === "design") numbers.features.forEach(put);
      else throw new Error(`no page computes the term '${name}' of the policy`);
    }
    return observation;
  }

  /** Command that the policy observes, as `Trim.command`. */
  asked() {
    const ends = this.numbers.trim.slice(10);
    return this.command.map((asked, i) => {
      const end = Math.max(ends[i], Math.abs(asked));
      return Math.min(end, Math.max(-end, asked + this.trimmed[i]));
    });
  }

  /** Trim the next action, as `Trim.next`. */
  trim() {
    const { numbers: { trim }, command, sensordata, sensors: [linear, angular], trimmed } = this;
    const period = this.policy?.period ?? 0;
    const moving = [sensordata[linear], sensordata[linear + 1], sensordata[angular + 2]];
    const missing = moving.map((one, i) => command[i] - one);
    [...missing, -missing[0], -missing[1]].forEach((error, i) => {
      const most = trim[5 + i];
      trimmed[i] = Math.min(most, Math.max(-most, trimmed[i] + trim[i] * period * error));
    });
  }

  /** One physics step; the policy acts at its rate, as in `Controller.step`. */
  step() {
    this.refresh();
    const { policy, network, numbers: p, qpos, qvel } = this;
    if (!policy || !network) return;
    if (this.since === 0) {
      this.action.set(network.run(this.observe()));
      this.trim();
    }
    this.since = (this.since + 1) % this.period;
    for (let i = 0; i < this.q.length; i++) {
      const speed = qvel[this.v[i]], peak = p.peak_torque[i], stall = p.stall_torque[i];
      const offset = p.sign[i] * p.action_scale[i] * this.action[i];
      const wanted = p.stiffness[i] * (p.home[i] + offset - qpos[this.q[i]]) +
        p.damping[i] * ((policy.rolls[i] ? offset : 0) - speed);
      const end = 1 + peak / stall, share = Math.min(end, Math.max(-end, speed / p.no_load_speed[i]));
      const most = Math.min(peak, stall * (1 - share)), least = Math.max(-peak, stall * (-1 - share));
      this.torque[i] = Math.min(most, Math.max(least, wanted));
      this.qfrc_applied[this.v[i]] = this.torque[i];
    }
    this.mujoco.mj_step(this.model, this.data);
  }

  /** One physics step with falls, as `Walk.step`. */
  walk() {
    const { policy } = this;
    if (!policy) return;
    this.step();
    this.refresh();
    if (!Number.isFinite(this.qpos[2])) {
      this.falls++;
      this.restart();
      return;
    }
    const low = this.xpos[3 * this.trunk + 2] < policy.fall.low * this.numbers.home_position[2];
    const tilted = this.xmat[9 * this.trunk + 8] < Math.cos(policy.fall.tilt);
    if (Number.isNaN(this.lying)) {
      if (low || tilted) { this.falls++; this.lying = this.data.time; }
    } else if (this.data.time - this.lying > DOWN) this.restart();
  }

  /**
   * Add a velocity in the heading frame of the trunk [m/s].
   * @param {number} forward
   * @param {number} left
   */
  push(forward, left) {
    const a = this.xmat[9 * this.trunk], b = this.xmat[9 * this.trunk + 3];
    const n = Math.max(Math.hypot(a, b), 1e-9);
    this.qvel[0] += (forward * a - left * b) / n;
    this.qvel[1] += (forward * b + left * a) / n;
  }

  /** Forward speed of the trunk in its own frame [m/s]. */
  get speed() {
    return this.sensors.length ? this.sensordata[this.sensors[0]] : 0;
  }
}

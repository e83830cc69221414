// MuJoCo for Python in a worker, which has no bindings of its own: `thin/mujoco.py` asks here.
// Models and states have numbers. Questions and answers are JSON, so that nothing else crosses.

export class Bridge {
  /** @param {any} mujoco its module */
  constructor(mujoco) {
    this.mujoco = mujoco;
    /** @type {Map<number, any>} */
    this.held = new Map();
    this.last = 0;
  }

  /**
   * Answer a question.
   * @param {string} question name of a method below and its arguments, as JSON
   * @returns {string} JSON; "problem" with its text where MuJoCo refuses
   */
  ask(question) {
    const [what, ...given] = JSON.parse(question);
    try {
      return JSON.stringify({ answer: /** @type {any} */ (this)[what](...given) ?? null });
    } catch (error) {
      return JSON.stringify({ problem: this.text(error) });
    }
  }

  /** @param {any} error of JavaScript, or an exception of C++ */
  text(error) {
    if (error instanceof Error) return error.message;
    const [kind, said] = this.mujoco.getExceptionMessage?.(error) ?? [String(error), ""];
    return said || kind;
  }

  version() {
    return this.mujoco.mj_versionString();
  }

  /**
   * Values of an enumeration by their names.
   * @param {string} name such as "mjtGeom"
   */
  members(name) {
    const found = Object.entries(this.mujoco[name]).filter(([, one]) => typeof one?.value === "number");
    return Object.fromEntries(found.map(([key, one]) => [key, one.value]));
  }

  /** @param {any} made */
  hold(made) {
    this.held.set(++this.last, made);
    return this.last;
  }

  /** @param {string} xml */
  model(xml) {
    return this.hold(this.mujoco.MjModel.from_xml_string(xml));
  }

  /** @param {number} model */
  data(model) {
    return this.hold(new this.mujoco.MjData(this.held.get(model)));
  }

  /** @param {number} key */
  free(key) {
    this.held.get(key).delete();
    this.held.delete(key);
  }

  /**
   * A number of a model or a state, or its array with its type.
   * @param {number} key
   * @param {string} name
   */
  read(key, name) {
    const value = this.held.get(key)[name];
    if (ArrayBuffer.isView(value)) return [value.constructor.name, [.../** @type {any} */ (value)]];
    return typeof value === "object" ? undefined : value; // As of functions.
  }

  /**
   * @param {number} key
   * @param {string} name
   * @param {number[]} values
   */
  write(key, name, values) {
    this.held.get(key)[name].set(values);
  }

  /**
   * Call a function of a model and its state.
   * @param {string} name
   * @param {number} model
   * @param {number} data
   */
  call(name, model, data) {
    this.mujoco[name](this.held.get(model), this.held.get(data));
  }

  /**
   * @param {number} model
   * @param {string} kind of an object, such as "mjOBJ_BODY"
   * @param {string} name
   */
  id(model, kind, name) {
    return this.mujoco.mj_name2id(this.held.get(model), this.mujoco.mjtObj[kind].value, name);
  }

  /**
   * @param {number} model
   * @param {string} kind
   * @param {number} id
   */
  name(model, kind, id) {
    return this.mujoco.mj_id2name(this.held.get(model), this.mujoco.mjtObj[kind].value, id);
  }

  /**
   * Distance of two geoms [m], at most `most`.
   * @param {number} model
   * @param {number} data
   * @param {number} first
   * @param {number} second
   * @param {number} most
   */
  distance(model, data, first, second, most) {
    return this.mujoco.mj_geomDistance(this.held.get(model), this.held.get(data), first, second, most, null);
  }
}

// The page: robots that walk side by side in real time, and the panel beside them.
import loadMujoco from "mujoco";
import { Bodies } from "draft/bodies";
import { Designer } from "draft/designer";
import { element } from "draft/element";
import { Limits } from "draft/limits";
import { page, part } from "draft/load";
import { Network } from "draft/network";
import { Picture } from "draft/picture";
import { Robot } from "draft/robot";
import { Steering } from "draft/steer";

const LATE = 0.1; // Time that is caught up with at most [s].
const PUSH = 0.35; // Velocity of a push per sqrt(g h), h the height of the robot's middle.
const SMOOTH = 0.03; // Weight of the newest speed in the one that is shown.
const $ = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

class Page {
  /**
   * @param {any} mujoco
   * @param {Map<string, Float32Array>} networks numbers by name
   * @param {Bodies[]} bodies of the robots, empty if none varies
   */
  constructor(mujoco, networks, bodies) {
    this.bodies = bodies;
    this.networks = networks;
    this.robots = page.robots.map((/** @type {any} */ one) => new Robot(mujoco, one, one.policy &&
      Network.read(/** @type {Float32Array} */ (networks.get(one.network)).slice(), one.policy.sizes), one.numbers));
    for (const robot of this.robots) robot.refresh(); // Each model may have grown the memory.
    this.shown = 0; // Robot of the panel.
    this.speeds = this.robots.map(() => 0);
    this.slow = 1;
    this.owed = 0;
    this.last = 0;
    this.count = { pictures: 0, simulated: 0, wall: 0, reshaped: 0 };
    this.limits = new Limits($("limits"));
    const sliders = ["forward", "left", "turn"].map($);
    for (const slider of sliders) slider.value = "0";
    this.ranges(sliders);
    this.steering = new Steering(sliders, { push: (side) => this.push(side), changed: () => this.steer() });
    this.buttons();
    this.shapes();
    this.picture = new Picture($("view"));
    this.picture.show(this.robots, page.robots.map((/** @type {any} */ one) => one.color), page.lanes);
    this.designer = new Designer(this);
    this.choose(0);
    this.open();
    requestAnimationFrame((now) => this.frame(now));
  }

  /**
   * Give the commands the ranges of the robots; values stay within them.
   * @param {HTMLInputElement[]} sliders
   */
  ranges(sliders) {
    const fastest = Math.max(0.1, ...page.robots.map((/** @type {any} */ one) => one.numbers.forward?.[0] ?? 0));
    [fastest, Math.min(0.6 * fastest, 0.6), 1].forEach((end, i) => {
      const { value } = sliders[i];
      Object.assign(sliders[i], { min: -end, max: end, step: end / 100 });
      sliders[i].value = value; // A change of the range alone would round it.
    });
  }

  buttons() {
    $("push").addEventListener("click", () => this.push(1));
    $("stand").addEventListener("click", () => { this.steering.command = [0, 0, 0]; });
    $("restart").addEventListener("click", () => this.robots.forEach((/** @type {Robot} */ one) => one.restart()));
    $("slow").addEventListener("input", () => this.steer());
    page.robots.forEach((/** @type {any} */ one, /** @type {number} */ i) => {
      const tab = element("button", one.title);
      tab.style.setProperty("--own", one.color);
      tab.addEventListener("click", () => this.choose(i));
      $("robots").append(tab);
    });
    $("robots").hidden = page.robots.length < 2;
    $("steering").hidden = this.robots.every((/** @type {Robot} */ one) => !one.policy);
  }

  /** Sliders of the bodies, in the numbers of the first robot; another is at the same share of its own range. */
  shapes() {
    $("body").hidden = !this.bodies.length;
    for (const { name, nodes, value } of this.bodies[0]?.vary.sliders ?? []) {
      const label = element("label", name.split(".").at(-1)?.replaceAll("_", " ") ?? name);
      const slider = document.createElement("input");
      Object.assign(slider, { type: "range", id: name, min: nodes[0], max: nodes.at(-1), step: "any", value });
      label.title = name;
      label.append(" ", element("output", ""), slider);
      slider.addEventListener("input", () => this.reshape());
      $("sliders").append(label);
    }
    const worst = (/** @type {"mass" | "inertia" | "length"} */ kind) => Math.max(...this.bodies.map(({ vary }) => vary.errors[kind]));
    if (this.bodies.length)
      $("accuracy").textContent = `Between the bodies that Draft compiled, masses are within ${(100 * worst("mass")).toFixed(1)} %, ` +
        `inertias ${(100 * worst("inertia")).toFixed(1)} %, lengths ${(1000 * worst("length")).toFixed(2)} mm of its own.`;
  }

  /** Sliders of the bodies. */
  get shaped() {
    return /** @type {HTMLInputElement[]} */ ([...$("sliders").querySelectorAll("input")]);
  }

  /**
   * Values of a robot's numbers.
   * @param {number} index of the robot
   */
  values(index) {
    return this.shaped.map((slider, i) => {
      const { nodes } = this.bodies[index].vary.sliders[i], end = /** @type {number} */ (nodes.at(-1));
      const share = (Number(slider.value) - Number(slider.min)) / (Number(slider.max) - Number(slider.min));
      return index ? nodes[0] + share * (end - nodes[0]) : Number(slider.value);
    });
  }

  /**
   * Give the robots the bodies of the sliders.
   * @param {boolean} moved whether by the visitor; else those that the designer has stay
   */
  reshape(moved = true) {
    if (!this.bodies.length) return;
    const begun = performance.now();
    this.bodies.forEach((bodies, i) => {
      const values = this.values(i);
      if (this.designer.slide(i, values, moved)) return;
      const { columns, said, between } = bodies.at(values);
      this.robots[i].setBody(columns, bodies.vary.columns);
      Object.assign(page.robots[i], { said, between });
      this.picture.figures[i].shape();
    });
    for (const robot of this.robots) robot.refresh();
    this.choose(this.shown);
    this.steer();
    this.count.reshaped = performance.now() - begun; // [ms]
  }

  /**
   * Put another robot in the place of one.
   * @param {number} index
   * @param {Robot} robot
   */
  put(index, robot) {
    this.robots[index].delete();
    this.robots[index] = robot;
    for (const one of this.robots) one.refresh();
    const { yaw, pitch, away } = this.picture;
    this.picture.show(this.robots, page.robots.map((/** @type {any} */ one) => one.color), page.lanes);
    Object.assign(this.picture, { yaw, pitch, away }); // The view is the visitor's.
    this.picture.follow(true);
    $("steering").hidden = this.robots.every((/** @type {Robot} */ one) => !one.policy);
    this.ranges(["forward", "left", "turn"].map($));
    this.steer();
  }

  /** Commands as the sliders have them, to all robots and to the link. */
  steer() {
    const command = this.steering.command;
    for (const robot of this.robots) {
      // Each is asked for no more than it was trained for.
      const most = robot.numbers.forward?.[0] ?? 0;
      robot.command = [Math.min(most, Math.max(-most, command[0])), command[1], command[2]];
    }
    ["m/s", "m/s", "rad/s"].forEach((unit, i) => {
      $(`${["forward", "left", "turn"][i]}-out`).textContent = `${command[i].toFixed(2)} ${unit}`;
    });
    this.slow = Number($("slow").value);
    $("slow-out").textContent = this.slow ? `${this.slow.toFixed(2)} x` : "paused";
    this.link();
  }

  /** @param {number} side 1 to the left, -1 to the right */
  push(side) {
    for (const robot of this.robots)
      if (robot.policy) robot.push(0, side * PUSH * Math.sqrt(9.81 * robot.height));
  }

  /** Take the values of the link, within their ranges. */
  open() {
    const given = new URLSearchParams(location.hash.slice(1)), said = [];
    const usual = { forward: 0.5 * Number($("forward").max), left: 0, turn: 0, slow: 1 };
    for (const [name, value] of Object.entries(usual)) {
      const slider = $(name), asked = given.has(name) ? Number(given.get(name)) : value;
      slider.value = String(Number.isFinite(asked) ? asked : value); // A slider keeps to its range.
      if (!(Math.abs(Number(slider.value) - asked) <= Number(slider.step)))
        said.push(`${name} is ${Number(slider.value).toPrecision(3)}, not ${given.get(name)}`);
    }
    for (const slider of this.shaped) {
      const asked = Number(given.get(slider.id) ?? slider.value);
      slider.value = String(Number.isFinite(asked) ? asked : slider.value);
      if (!(Math.abs(Number(slider.value) - asked) < 1e-6)) said.push(`${slider.id} is ${slider.value}, not ${given.get(slider.id)}`);
    }
    const known = new Set([...Object.keys(usual), ...this.shaped.map((slider) => slider.id)]);
    for (const name of given.keys()) if (name && !known.has(name)) said.push(`there is no ${name}`);
    if (said.length) $("note").textContent = `Of the link: ${said.join("; ")}.`;
    if (this.bodies.length) this.reshape();
    else this.steer();
  }

  /** Write the values to the link. */
  link() {
    const values = ["forward", "left", "turn", "slow"].map((name) => [name, String(Number(Number($(name).value).toFixed(3)))]);
    for (const slider of this.shaped) values.push([slider.id, String(Number(Number(slider.value).toPrecision(5)))]);
    if (location.protocol !== "about:") history.replaceState(null, "", `#${new URLSearchParams(values)}`);
  }

  /** @param {number} index robot whose numbers the panel shows */
  choose(index) {
    this.shown = index;
    this.limits.clear();
    const one = page.robots[index], { said } = one, { model } = this.robots[index];
    this.shaped.forEach((slider, i) => {
      const shown = slider.parentElement?.querySelector("output"), { unit } = this.bodies[index].vary.sliders[i];
      const value = this.designer.number(index, slider.id, this.values(index)[i]);
      if (shown) shown.textContent = value === null ? "–" : `${value.toPrecision(3)} ${unit}`;
    });
    [...$("robots").children].forEach((tab, i) => tab.classList.toggle("chosen", i === index));
    $("name").textContent = one.title;
    const masses = Object.entries(one.bodies).map(([name, id]) => /** @type {const} */ ([name, model.body_mass[id]]));
    $("mass").textContent = `${masses.reduce((sum, [, mass]) => sum + mass, 0).toFixed(2)} kg`;
    $("why").textContent = one.why ? `It stands: ${one.why}.` : said.outside ? `This body is ${said.outside}.` : "";
    $("findings").replaceChildren(...said.findings.map((/** @type {string[]} */ [severity, id, text]) => {
      const row = element("li", "", severity);
      row.append(element("b", id.replaceAll("_", " ")), ` ${text}`);
      return row;
    }));
    $("verdict").textContent = (one.between ? "Between nodes; the nearest one: " : "") + (said.accepted ? (said.findings.length ? "It could be built." : "It could be built; no findings.") : "It could not be built:");
    $("masses").replaceChildren(...masses.map(([name, mass]) => {
      const row = document.createElement("tr");
      row.append(element("th", name.replaceAll("_", " ")), element("td", `${mass.toFixed(3)} kg`));
      return row;
    }));
    $("load").hidden = !one.policy;
    this.designer.show(index);
  }

  /**
   * Simulate for a while.
   * @param {number} seconds
   */
  advance(seconds) {
    this.owed = Math.min(this.owed + seconds, LATE);
    const step = Math.min(...this.robots.map((/** @type {Robot} */ one) => one.policy?.timestep ?? 1));
    for (; this.owed >= step; this.owed -= step) {
      for (const robot of this.robots) robot.walk();
      this.count.simulated += step;
    }
    for (const robot of this.robots) robot.refresh();
  }

  /** @param {number} now [ms] */
  frame(now) {
    requestAnimationFrame((next) => this.frame(next));
    const gone = this.last ? (now - this.last) / 1000 : 0;
    this.last = now;
    this.count.wall += gone;
    this.advance(gone * this.slow);
    const robot = this.robots[this.shown];
    if (robot.policy) this.limits.add(robot);
    this.robots.forEach((/** @type {Robot} */ one, /** @type {number} */ i) => { this.speeds[i] += SMOOTH * (one.speed - this.speeds[i]); });
    if ($("follow").checked) this.picture.follow();
    this.picture.pace(gone);
    this.picture.draw();
    if (this.count.pictures++ % 15 === 0) this.report();
    if ($("load").open && this.count.pictures % 3 === 0) $("busiest").textContent = this.limits.draw(robot) || $("busiest").textContent;
  }

  report() {
    const robot = this.robots[this.shown];
    const falls = robot.falls === 1 ? "1 fall" : `${robot.falls} falls`;
    $("speed").textContent = robot.policy
      ? `${this.speeds[this.shown].toFixed(2)} m/s of ${robot.command[0].toFixed(2)} asked, ${falls}`
      : "";
  }
}

/** @param {any} error */
function refuse(error) {
  const text = error?.message ?? String(error);
  console.error(error);
  $("note").textContent = /WebGL/i.test(text)
    ? "This browser offers no WebGL, which the picture needs."
    : `The page cannot run here: ${text}`;
}

async function start() {
  if (typeof WebAssembly !== "object" || typeof DecompressionStream !== "function")
    throw new Error("it needs WebAssembly and DecompressionStream, of browsers since 2023");
  const names = [...new Set(page.robots.map((/** @type {any} */ one) => one.network).filter(Boolean))];
  const [wasmBinary, ...rows] = await Promise.all(["mujoco.wasm", ...names].map(part));
  const mujoco = await loadMujoco({ wasmBinary, locateFile: () => "" });
  if (mujoco.mj_versionString() !== page.mujoco)
    throw new Error(`its MuJoCo is ${mujoco.mj_versionString()}, and the robots are of ${page.mujoco}`);
  const numbers = new Map(names.map((name, i) => [name, new Float32Array(rows[i])]));
  const bodies = await Promise.all(page.vary.map(async (/** @type {any} */ vary, /** @type {number} */ i) =>
    new Bodies(vary, new Float32Array(await part(`bodies-${i}`)))));
  $("note").textContent = "";
  Object.assign(window, { draftPage: new Page(mujoco, numbers, bodies) }); // For tests and measurements.
}

start().catch(refuse);

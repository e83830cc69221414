// Changing any number or file of a design: its fields and texts. `asking.js` finds who answers.
import { PythonWorker, askProcess } from "draft/asking";
import { element } from "draft/element";
import { page } from "draft/load";
import { Network } from "draft/network";
import { Robot } from "draft/robot";

const $ = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));
const NEEDED = ["parameters.yaml", "tree.yaml"]; // A fixed base has no trunk.
const DIGITS = 5; // Of the numbers of sliders.

/**
 * @typedef {object} Source what messages say of a robot
 * @property {Record<string, string>} files texts by name
 * @property {Record<string, string>} binary contents of files that are no text, in base64, by name
 * @property {Record<string, number | string | null>} values in place of those of the files
 * @property {string} title "" for the name that the files give
 * @property {{name: string, unit: string, text: string, value: number?, low: number?, high: number?, doc: string}[]} fields
 */

/**
 * @typedef {{where: string, cause: string, remedy: string}} Problem
 */

/**
 * Whether two numbers are one in the digits that sliders have.
 * @param {number} a
 * @param {number} b
 */
function same(a, b) {
  return a.toPrecision(DIGITS) === b.toPrecision(DIGITS);
}

/**
 * A word of a command, which a shell takes as one.
 * @param {string} word
 */
function quoted(word) {
  return /^[\w.=+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
}

export class Designer {
  /** @param {any} main the page whose robots change */
  constructor(main) {
    this.main = main;
    /** @type {Source[]} */
    this.sources = page.robots.map((/** @type {any} */ { title, source }) => ({ title, ...source }));
    this.first = this.sources.map((one) => structuredClone(one)); // As the page was written.
    this.shown = 0;
    this.file = NEEDED[0];
    this.changed = page.robots.map(() => false); // Robots that a designer has replaced.
    /** @type {Set<number>} Robots whose files are others, which the page's own sliders do not know. */
    this.others = new Set();
    /** @type {Problem[][]} */
    this.problems = page.robots.map(() => []);
    this.status = ""; // Of Python while it starts.
    /** @type {[number, string, string]} Robot, file and text that the field of texts was filled with. */
    this.filled = [-1, "", ""];
    /** @type {Set<number>} Robots that have changed since they were asked for. */
    this.wanted = new Set();
    this.busy = false;
    this.asking = -1; // Robot of the question that has no answer yet.
    this.count = 0;
    /** @type {Map<string, number>[]} Numbers of the page's own sliders for each robot, by name. */
    this.slid = page.robots.map((/** @type {any} */ _, /** @type {number} */ i) => new Map(
      main.bodies[i]?.vary.sliders.map((/** @type {any} */ { name, value }) => [name, value])));
    this.ask = askProcess;
    $("design").hidden = !page.designer.kind;
    if (!page.designer.kind) return;
    const { kind } = page.designer;
    $("design-python").hidden = kind !== "python";
    if (kind === "python") $("design-host").textContent = new URL(page.designer.own).host;
    $("design-fields").disabled = kind === "python"; // Until Python has started.
    $("design-start").addEventListener("click", () => this.start());
    $("design-back").addEventListener("click", () => {
      this.others.delete(this.shown);
      this.reset(structuredClone(this.first[this.shown]));
    });
    $("design-clear").addEventListener("click", () => this.reset({ ...this.sources[this.shown], values: {} }));
    $("design-file").addEventListener("change", () => this.open($("design-file").value));
    $("design-apply").addEventListener("click", () => this.take({ [this.file]: $("design-text").value }));
    $("design-open").addEventListener("change", () => this.drop([...$("design-open").files]));
    const place = $("design");
    place.addEventListener("dragover", (/** @type {DragEvent} */ event) => event.preventDefault());
    place.addEventListener("drop", (/** @type {DragEvent} */ event) => {
      event.preventDefault();
      if (!$("design-fields").disabled) this.drop([...(event.dataTransfer?.files ?? [])]);
    });
  }

  /** Start Python in a worker, which asks a host outside the page for it. */
  start() {
    const python = new PythonWorker((text) => {
      this.status = text;
      this.say();
    });
    this.ask = (/** @type {string} */ message) => python.ask(message);
    $("design-start").disabled = true;
    this.want(this.shown).then((answered) => {
      $("design-start").disabled = answered;
      $("design-python").hidden = answered;
      if (!answered) python.worker.terminate();
      $("design-fields").disabled = !answered;
    });
  }

  /** @param {number} index robot whose numbers and files are shown */
  show(index) {
    this.shown = index;
    if (!page.designer.kind) return;
    const { files, fields, values } = this.sources[index], rows = $("design-rows");
    const names = fields.map(({ name }) => name).join();
    if (rows.dataset.names !== names) rows.replaceChildren(...fields.map(({ name }) => this.field(name)));
    rows.dataset.names = names;
    fields.forEach(({ name, text, unit, low, high, doc }, i) => {
      const input = rows.children[i].querySelector("input");
      if (document.activeElement !== input || !this.busy) input.value = String(values[name] ?? text);
      rows.children[i].querySelector("output").textContent = unit;
      rows.children[i].title = `${doc}${low === null ? "" : ` From ${low} to ${high} ${unit}.`}`;
    });
    $("design-file").replaceChildren(...Object.keys(files).map((name) => element("option", name)));
    this.open(this.file in files ? this.file : NEEDED[0]);
    this.summarise();
    this.say();
  }

  /** @param {string} name */
  field(name) {
    const label = element("label", ""), input = document.createElement("input");
    const parts = name.split(".");
    const shown = parts[0] === "actuators" ? `${parts[1]}: ${parts[2]}` : name;
    label.append(element("span", shown.replaceAll("_", " ")), input, element("output", ""));
    input.dataset.name = name;
    input.spellcheck = false;
    input.addEventListener("change", () => this.put({ [name]: input.value.trim() }));
    return label;
  }

  /**
   * Take values; an empty text leaves what the files say.
   * @param {Record<string, string>} texts
   */
  put(texts) {
    const { values } = this.sources[this.shown];
    for (const [name, text] of Object.entries(texts)) {
      if (text === "") delete values[name];
      else values[name] = Number.isFinite(Number(text)) ? Number(text) : text;
    }
    return this.want(this.shown);
  }

  /** @param {string} name of a file */
  open(name) {
    this.file = $("design-file").value = name;
    const text = this.sources[this.shown].files[name], before = this.filled;
    this.filled = [this.shown, name, text];
    // What is written there stays until it is applied, or another text is shown.
    if (this.filled.some((one, i) => one !== before[i])) $("design-text").value = text;
  }

  /**
   * Take files of one's own. With all that a robot needs they are another robot, without the values
   * of the last one.
   * @param {Record<string, string>} given texts by name
   */
  take(given) {
    const last = this.sources[this.shown];
    if (NEEDED.every((name) => name in given)) {
      this.others.add(this.shown);
      return this.reset({ ...last, files: given, binary: {}, values: {}, title: "" });
    }
    return this.reset({ ...last, files: { ...last.files, ...given } });
  }

  /** @param {File[]} files */
  async drop(files) {
    const index = this.shown, last = this.sources[index], names = Object.keys(last.files);
    const given = /** @type {Record<string, string>} */ ({});
    $("design-open").value = ""; // The same file can be chosen again.
    for (const file of files) {
      // A browser gives no folders: `designs/NAME.yaml` comes as `NAME.yaml`.
      const name = names.find((one) => one.split("/").at(-1) === file.name) ?? file.name;
      const text = file.size <= page.designer.most ? await file.text() : null;
      if (text === null || /[\0\uFFFD]/.test(text)) {
        const cause = text === null ? `it has ${file.size} bytes, and ${page.designer.most} are the most` : "it is no text";
        this.refuse(index, [{ where: file.name, cause, remedy: "give texts of a robot: YAML, CSV or JSON" }]);
        return;
      }
      given[name] = text;
    }
    const waits = this.busy, whole = NEEDED.every((name) => name in given);
    const more = !whole && Object.keys(given).some((name) => !names.includes(name));
    await this.take(given);
    // A file that the robot does not use would be refused with each change that follows.
    if (more && !waits && this.problems[index].length) {
      this.sources[index] = last;
      this.show(this.shown);
    }
  }

  /** @param {Source} source */
  reset(source) {
    this.sources[this.shown] = source;
    this.show(this.shown);
    return this.want(this.shown);
  }

  /**
   * Hear of the page's own sliders. Once the designer has replaced a robot, it takes their numbers.
   * @param {number} index of the robot
   * @param {number[]} numbers of the sliders for it
   * @param {boolean} moved whether by the visitor; else robots that the designer has replaced stay
   * @returns {boolean} whether it does
   */
  slide(index, numbers, moved) {
    if (!page.designer.kind) return false;
    const { values } = this.sources[index], own = this.changed[index], slid = this.slid[index];
    const follows = !this.others.has(index) && (moved || !own);
    let differs = false;
    this.main.shaped.forEach((/** @type {HTMLInputElement} */ { id }, /** @type {number} */ i) => {
      if (same(/** @type {number} */ (slid.get(id)), numbers[i])) return;
      slid.set(id, numbers[i]);
      if (follows) values[id] = Number(numbers[i].toPrecision(DIGITS));
      differs = true;
    });
    if (differs && follows && (own || this.asking === index)) this.want(index);
    return own || this.others.has(index);
  }

  /**
   * Number of a robot that one of the page's own sliders is about.
   * @param {number} index of the robot
   * @param {string} name
   * @param {number} slid number of the slider for it
   * @returns {number | null} null if the robot has other files
   */
  number(index, name, slid) {
    if (this.others.has(index)) return null;
    if (!this.changed[index]) return slid;
    return this.sources[index].fields.find((one) => one.name === name)?.value ?? slid;
  }

  /**
   * Ask for a robot as it is wanted now; of several questions in a row, the last is asked.
   * @param {number} index
   * @returns {Promise<boolean>} whether it was answered, if only by problems
   */
  async want(index) {
    this.wanted.add(index);
    if (this.busy) return true;
    this.busy = true;
    let answered = true;
    for (const next of this.wanted) {
      this.wanted.delete(next);
      this.asking = next;
      const { color } = page.robots[next], { files, binary, values, title } = this.sources[next];
      const id = ++this.count, known = [...this.main.networks.keys()];
      try {
        const found = JSON.parse(await this.ask(JSON.stringify({ id, files, binary, values, title, color, known })));
        if (found.problems) this.refuse(next, found.problems);
        else this.replace(next, found);
      } catch (error) {
        answered = false;
        this.refuse(next, [{ where: "", cause: /** @type {Error} */ (error).message, remedy: "" }]);
      }
    }
    this.busy = false;
    this.asking = -1;
    this.summarise();
    return answered;
  }

  /**
   * @param {number} index
   * @param {Problem[]} problems
   */
  refuse(index, problems) {
    this.problems[index] = problems;
    this.say();
  }

  /** Say what is wrong with the robot that is shown, else what Python does. */
  say() {
    const problems = this.problems[this.shown];
    $("design-note").textContent = problems.length ? "The robot is as before:" : this.status;
    $("design-problems").replaceChildren(...problems.map(({ where, cause, remedy }) => {
      const row = element("li", "", "error");
      row.append(where ? element("b", `${where} `) : "", cause, remedy ? element("div", remedy) : "");
      return row;
    }));
  }

  /**
   * @param {number} index
   * @param {{robot: any, network?: string, fields: any[]}} found
   */
  replace(index, { robot: record, network, fields }) {
    const { main } = this, { networks } = main, last = main.robots[index];
    if (network) {
      const bytes = Uint8Array.from(atob(network), (c) => c.charCodeAt(0));
      networks.set(record.network, new Float32Array(bytes.buffer));
    }
    const own = record.policy ? Network.read(networks.get(record.network).slice(), record.policy.sizes) : null;
    const robot = new Robot(last.mujoco, record, own, record.numbers);
    robot.resume(last);
    page.robots[index] = record;
    for (const name of networks.keys())
      if (page.robots.every((/** @type {any} */ one) => one.network !== name)) networks.delete(name);
    main.put(index, robot);
    $("robots").children[index].textContent = record.title;
    this.changed[index] = true;
    this.sources[index].fields = fields;
    this.problems[index] = [];
    this.status = "";
    let moved = false;
    // The sliders are in its numbers, unless it waits for newer ones of theirs or has other files.
    for (const slider of index || this.wanted.has(index) || this.others.has(index) ? [] : main.shaped) {
      const value = fields.find(({ name }) => name === slider.id)?.value, { value: before } = slider;
      if (value === undefined || same(value, Number(before))) continue;
      slider.value = String(value); // It keeps to its range.
      this.slid[0].set(slider.id, Number(slider.value));
      moved ||= slider.value !== before;
    }
    if (moved) main.reshape(false);
    main.choose(this.shown);
  }

  /** Say which values are not those that the page was written with, as `draft` takes them. */
  summarise() {
    const { values } = this.sources[this.shown], before = this.first[this.shown].values;
    const changed = Object.entries(values).filter(([name, value]) => value !== before[name]);
    $("design-changed").textContent = changed.length ? `--set ${changed.map(([name, value]) => quoted(`${name}=${value}`)).join(" ")}` : "";
  }
}

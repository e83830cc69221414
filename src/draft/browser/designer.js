// Changing any number or file of a design: fields and texts, and who answers (`designer.py`).
import { page } from "draft/load";
import { Network } from "draft/network";
import { Robot } from "draft/robot";

const $ = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));
const NEEDED = ["parameters.yaml", "tree.yaml"], TRUNK = "root.yaml"; // A fixed base has no trunk.

/**
 * @typedef {object} Source what messages say of a robot
 * @property {Record<string, string>} files texts by name
 * @property {Record<string, number | string | null>} values in place of those of the files
 * @property {string} [title] "" for the name that the files give; else that of the page
 * @property {{name: string, unit: string, text: string, low: number?, high: number?, doc: string}[]} fields
 */

/**
 * Ask the process that serves a live page.
 * @param {string} message
 * @returns {Promise<string>}
 */
async function askProcess(message) {
  let answer;
  try {
    answer = await fetch("./designer", { method: "POST", body: message, headers: { "Content-Type": "application/json" } });
  } catch {
    throw new Error("The process of this page has ended: run `draft page` with `--live` again.");
  }
  if (answer.ok) return answer.text();
  throw new Error(answer.status === 500 || answer.status === 413 ? `${answer.status}: ${await answer.text()}`
    : "Nothing here changes designs: run `draft page` with `--live`, whose page this is.");
}

/** Python in a worker, which starts with the first question. */
class PythonWorker {
  /** @param {(text: string) => void} said hears what it does while it starts */
  constructor(said) {
    this.worker = new Worker("./designer-worker.js", { type: "module" });
    /** @type {{take: (text: string) => void, refuse: (error: Error) => void} | null} */
    this.waiting = null;
    this.worker.addEventListener("message", ({ data }) => {
      if (data.status) said(data.status);
      else if (data.problem) this.waiting?.refuse(new Error(data.problem));
      else this.waiting?.take(data.answer);
    });
    this.worker.addEventListener("error", (event) =>
      this.waiting?.refuse(new Error(`Python does not start here: ${event.message ?? "its worker cannot be read"}`)));
    this.worker.postMessage({ start: page.designer });
  }

  /**
   * @param {string} message
   * @returns {Promise<string>}
   */
  ask(message) {
    return new Promise((take, refuse) => {
      this.waiting = { take, refuse };
      this.worker.postMessage({ message });
    });
  }
}

/**
 * An element with a text, which is never read as HTML.
 * @param {string} tag
 * @param {string} text
 */
function element(tag, text) {
  const made = document.createElement(tag);
  made.textContent = text;
  return made;
}

export class Designer {
  /** @param {any} main the page whose robots change */
  constructor(main) {
    this.main = main;
    /** @type {Source[]} */
    this.sources = page.robots.map((/** @type {any} */ one) => one.source);
    this.first = this.sources.map((one) => structuredClone(one)); // As the page was written.
    this.shown = 0;
    this.file = NEEDED[0];
    this.changed = page.robots.map(() => false); // Robots that a designer has replaced.
    /** @type {Set<number>} Robots that have changed since they were asked for. */
    this.wanted = new Set();
    this.busy = false;
    this.count = 0;
    /** @type {Map<string, number>[]} Numbers of the page's own sliders for each robot, by name. */
    this.slid = page.robots.map(() => new Map());
    this.ask = askProcess;
    $("design").hidden = !page.designer.kind;
    if (!page.designer.kind) return;
    const { kind } = page.designer;
    $("design-python").hidden = kind !== "python";
    if (kind === "python") $("design-host").textContent = new URL(page.designer.own).host;
    $("design-fields").disabled = kind === "python"; // Until Python has started.
    $("design-start").addEventListener("click", () => this.start());
    $("design-back").addEventListener("click", () => this.reset(structuredClone(this.first[this.shown])));
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
    const python = new PythonWorker((text) => { $("design-note").textContent = text; });
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
    const { files, fields } = this.sources[index], rows = $("design-rows");
    const names = fields.map(({ name }) => name).join();
    if (rows.dataset.names !== names) rows.replaceChildren(...fields.map(({ name }) => this.field(name)));
    rows.dataset.names = names;
    fields.forEach(({ text, unit, low, high, doc }, i) => {
      const input = rows.children[i].querySelector("input");
      if (document.activeElement !== input || !this.busy) input.value = text;
      rows.children[i].querySelector("output").textContent = unit;
      rows.children[i].title = `${doc}${low === null ? "" : ` From ${low} to ${high} ${unit}.`}`;
    });
    $("design-file").replaceChildren(...Object.keys(files).map((name) => element("option", name)));
    this.open(this.file in files ? this.file : NEEDED[0]);
    this.summarise();
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
    $("design-text").value = this.sources[this.shown].files[name];
  }

  /**
   * Take files of one's own. With all that a robot needs they are another robot, without the values
   * of the last one.
   * @param {Record<string, string>} given texts by name
   */
  take(given) {
    const last = this.sources[this.shown];
    if (NEEDED.every((name) => name in given)) return this.reset({ ...last, files: given, values: {}, title: "" });
    return this.reset({ ...last, files: { ...last.files, ...given } });
  }

  /** @param {File[]} files */
  async drop(files) {
    const known = new Set([...NEEDED, TRUNK, ...Object.keys(this.sources[this.shown].files)]);
    const strange = files.filter(({ name }) => !known.has(name));
    $("design-open").value = "";
    if (strange.length) {
      this.refuse([{ where: strange[0].name, cause: "a robot has no such file", remedy: `files: ${[...known].join(", ")}` }]);
      return;
    }
    const texts = await Promise.all(files.map((file) => file.text()));
    await this.take(Object.fromEntries(files.map(({ name }, i) => [name, texts[i]])));
  }

  /** @param {Source} source */
  reset(source) {
    this.sources[this.shown] = source;
    return this.want(this.shown);
  }

  /**
   * Hear of the page's own sliders. Once the designer has replaced a robot, it takes their numbers.
   * @param {number} index of the robot
   * @param {number[]} numbers of the sliders for it
   * @returns {boolean} whether it does
   */
  slide(index, numbers) {
    if (!page.designer.kind) return false;
    const { values, fields } = this.sources[index];
    this.main.shaped.forEach((/** @type {HTMLInputElement} */ { id }, /** @type {number} */ i) => {
      if (this.slid[index].get(id) === numbers[i]) return;
      this.slid[index].set(id, numbers[i]);
      values[id] = Number(numbers[i].toPrecision(5));
      for (const field of fields) if (field.name === id) field.text = String(values[id]);
    });
    if (this.changed[index]) this.want(index);
    return this.changed[index];
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
      const { color, title: usual } = page.robots[next], { files, values, title = usual } = this.sources[next];
      const id = ++this.count, known = [...this.main.networks.keys()];
      try {
        const found = JSON.parse(await this.ask(JSON.stringify({ id, files, values, title, color, known })));
        if (found.problems) this.refuse(found.problems);
        else this.replace(next, found);
      } catch (error) {
        answered = false;
        this.refuse([{ where: "", cause: /** @type {Error} */ (error).message, remedy: "" }]);
      }
    }
    this.busy = false;
    this.summarise();
    return answered;
  }

  /** @param {{where: string, cause: string, remedy: string}[]} problems */
  refuse(problems) {
    $("design-note").textContent = "The robot is as before:";
    $("design-problems").replaceChildren(...problems.map(({ where, cause, remedy }) => {
      const row = element("li", "");
      row.className = "error";
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
    const own = record.policy ? Network.read(networks.get(record.network), record.policy.sizes) : null;
    const robot = new Robot(last.mujoco, record, own, record.numbers);
    robot.resume(last);
    page.robots[index] = record;
    main.put(index, robot);
    $("robots").children[index].textContent = record.title;
    this.changed[index] = true;
    this.sources[index].fields = fields;
    for (const slider of index === 0 ? main.shaped : []) {
      const value = fields.find(({ name }) => name === slider.id)?.value;
      if (value === undefined || value === Number(slider.value)) continue;
      slider.value = String(value); // It keeps to its range.
      this.slid[0].set(slider.id, Number(slider.value));
    }
    $("design-note").textContent = "";
    $("design-problems").replaceChildren();
    main.choose(this.shown);
  }

  /** Say which values are not those that the page was written with, as `draft` takes them. */
  summarise() {
    const { values } = this.sources[this.shown], before = this.first[this.shown].values;
    const changed = Object.entries(values).filter(([name, value]) => value !== before[name]);
    $("design-changed").textContent = changed.length ? `--set ${changed.map(([name, value]) => `${name}=${value}`).join(" ")}` : "";
  }
}

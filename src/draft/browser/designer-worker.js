// Python in a worker, so that no answer halts the picture: it takes the messages of `designer.js`.
// @ts-ignore: a file of the page, beside this one.
import loadMujoco from "./mujoco.js";
import { Bridge } from "./bridge.js";
import { fetched } from "./compressed.js";

const HOME = "/draft"; // Draft and its thin `mujoco`, in the worker's own file system.

/**
 * Fetch a file of Pyodide; the browser refuses any other content than that of its hash.
 * @param {string} address
 * @param {string} integrity
 */
async function checked(address, integrity) {
  let answer;
  try {
    answer = await fetch(address, { integrity });
  } catch {
    throw new Error(`${address} cannot be had, or is not the file that this page was written for`);
  }
  if (!answer.ok) throw new Error(`${address}: ${answer.status}`);
  return answer.blob();
}

/** @param {{own: string, packages: string, hashes: Record<string, string>, needed: string[], skill: string}} settings */
async function start({ own, packages, hashes, needed, skill }) {
  const say = (/** @type {string} */ status) => postMessage({ status });
  say("Python is loading.");
  const names = Object.keys(hashes);
  const [archive, wasmBinary, ...blobs] = await Promise.all([fetched("draft.zip"), fetched("mujoco.wasm"),
    ...names.map((name) => checked(own + name, hashes[name]))]);
  const at = Object.fromEntries(names.map((name, i) => [name, URL.createObjectURL(
    new Blob([blobs[i]], { type: name.endsWith(".wasm") ? "application/wasm" : "text/javascript" }))]));
  const { loadPyodide } = await import(at["pyodide.mjs"]);
  const { default: createPyodideModule } = await import(at["pyodide.asm.mjs"]);
  // It asks for the rest by name, which was fetched by hash above.
  const plain = globalThis.fetch;
  globalThis.fetch = (address, options) => plain(at[String(address).replace(own, "")] ?? address, options);
  say("Python is starting.");
  const python = await loadPyodide({
    indexURL: own, createPyodideModule, packageBaseUrl: packages,
    lockFileContents: JSON.parse(await blobs[names.indexOf("pyodide-lock.json")].text()),
  });
  const bridge = new Bridge(await loadMujoco({ wasmBinary, locateFile: () => "" }));
  python.registerJsModule("mujoco_js", { ask: (/** @type {string} */ text) => bridge.ask(text) });
  const failed = /** @type {string[]} */ ([]);
  await python.loadPackage(needed, { messageCallback: () => {}, errorCallback: (/** @type {string} */ text) => failed.push(text) });
  if (failed.length) throw new Error(failed.join(" ").replaceAll("\n", " "));
  python.unpackArchive(archive, "zip", { extractDir: HOME });
  python.runPython(`import sys; sys.path[:0] = ["${HOME}", "${HOME}/draft/browser/thin"]`);
  say("Draft is starting.");
  const designer = python.pyimport("draft.browser.designer").Designer(skill);
  say("Draft runs in this page.");
  return designer;
}

/** @type {Promise<any>} */
let designer;

addEventListener("message", async ({ data }) => {
  if (data.start) {
    designer = start(data.start);
    designer.catch(() => {}); // It is said with the answer to the first message.
    return;
  }
  let what = "Python does not start here";
  try {
    const started = await designer;
    what = "Draft failed";
    postMessage({ answer: started.answer(data.message) });
  } catch (error) {
    postMessage({ problem: `${what}: ${/** @type {Error} */ (error).message.trim().split("\n").at(-1)}` });
  }
});

// Who answers the messages of a page: a process of this machine, or Python in a worker (`designer.py`).
import { page } from "draft/load";

/**
 * Ask the process that serves a live page.
 * @param {string} message
 * @returns {Promise<string>}
 */
export async function askProcess(message) {
  const body = new Blob([message]); // Its size is in bytes.
  if (body.size > page.designer.most)
    throw new Error(`The files of this robot make a message of ${body.size} bytes, and one has ${page.designer.most} at most.`);
  let answer;
  try {
    answer = await fetch("./designer", { method: "POST", body, headers: { "Content-Type": "application/json" } });
  } catch {
    throw new Error("The process of this page has ended: run `draft page` with `--live` again.");
  }
  if (answer.ok) return answer.text();
  throw new Error(answer.status === 500 || answer.status === 413 ? `${answer.status}: ${await answer.text()}`
    : "Nothing here changes designs: run `draft page` with `--live`, whose page this is.");
}

/** Python in a worker, which starts with the first question. */
export class PythonWorker {
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

// What a page was written with: its data, and its larger parts, which are compressed.

/** Data of the page. */
export const page = JSON.parse(/** @type {HTMLElement} */ (document.getElementById("draft-page")).textContent ?? "");

/**
 * Bytes of a part, which lies in the page or beside it.
 * @param {string} name
 * @returns {Promise<ArrayBuffer>}
 */
export async function part(name) {
  const inside = document.getElementById(`part-${name}`);
  let packed;
  if (inside) {
    packed = new Blob([Uint8Array.from(atob(inside.textContent ?? ""), (c) => c.charCodeAt(0))]).stream();
  } else {
    const answer = await fetch(`./${name}.gz`);
    if (!answer.ok || !answer.body) throw new Error(`${name}.gz: ${answer.status}; the page needs all of its folder`);
    packed = answer.body;
  }
  return new Response(packed.pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

// What a page was written with: its data, and its larger parts.
import { fetched, unpacked } from "draft/compressed";

/** Data of the page. */
export const page = JSON.parse(/** @type {HTMLElement} */ (document.getElementById("draft-page")).textContent ?? "");

/**
 * Bytes of a part, which lies in the page or beside it.
 * @param {string} name
 * @returns {Promise<ArrayBuffer>}
 */
export async function part(name) {
  const inside = document.getElementById(`part-${name}`);
  if (!inside) return fetched(name);
  return unpacked(new Blob([Uint8Array.from(atob(inside.textContent ?? ""), (c) => c.charCodeAt(0))]).stream());
}

// The larger parts of a page, which are compressed, for the page and for a worker of it.

/**
 * Fetch a part from the folder of the page.
 * @param {string} name
 * @returns {Promise<ArrayBuffer>}
 */
export async function fetched(name) {
  const answer = await fetch(`./${name}.gz`);
  if (!answer.ok || !answer.body) throw new Error(`${name}.gz: ${answer.status}; the page needs all of its folder`);
  return unpacked(answer.body);
}

/**
 * @param {ReadableStream<any>} stream of a compressed part
 * @returns {Promise<ArrayBuffer>}
 */
export function unpacked(stream) {
  return new Response(stream.pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

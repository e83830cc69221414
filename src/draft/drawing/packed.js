// Numbers that a page carries as bytes, see `draft.drawing.packed`.
const KINDS = /** @type {any} */ ({ f4: Float32Array, i2: Int16Array });

/** @param {{dtype: string, bdata: string}} packed */
export function unpack({ dtype, bdata }) {
  return new KINDS[dtype](Uint8Array.from(atob(bdata), (c) => c.charCodeAt(0)).buffer);
}

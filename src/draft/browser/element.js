// Elements with texts.

/**
 * An element with a text, which is never read as HTML.
 * @param {string} tag
 * @param {string} text
 * @param {string} kind class of it
 */
export function element(tag, text, kind = "") {
  const made = document.createElement(tag);
  made.textContent = text;
  if (kind) made.className = kind;
  return made;
}

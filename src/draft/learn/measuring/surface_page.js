"use strict";
// Shows the design under the pointer in all maps at once; a click keeps it.
const card = document.getElementById("design");
let kept = null;

function show(i) {
  dispatchEvent(new CustomEvent("design", { detail: i })); // For the robot's picture.
  for (const svg of document.querySelectorAll("svg")) {
    const cell = svg.querySelector(`rect[data-i="${i}"]`);
    const mark = svg.querySelector(".mark");
    for (const name of ["x", "y", "width", "height"]) mark.setAttribute(name, cell.getAttribute(name));
    mark.setAttribute("visibility", "visible");
  }
  const table = document.createElement("table");
  for (const [name, text] of DESIGNS[i].rows) {
    const row = table.insertRow();
    // A long name breaks after its dots.
    row.insertCell().append(...name.split(/(?<=\.)/).flatMap((part) => [part, document.createElement("wbr")]));
    row.insertCell().textContent = text;
  }
  const code = document.createElement("code");
  code.textContent = DESIGNS[i].command;
  const words = document.createElement("p");
  words.textContent = "See it walk:";
  card.replaceChildren(table, ...(code.textContent ? [words, code] : []));
}

for (const svg of document.querySelectorAll("svg")) {
  svg.addEventListener("pointermove", (event) => {
    const i = event.target.dataset.i;
    if (i !== undefined && kept === null) show(Number(i));
  });
  svg.addEventListener("click", (event) => {
    const i = event.target.dataset.i;
    if (i === undefined) return;
    kept = kept === Number(i) ? null : Number(i);
    show(Number(i));
  });
}

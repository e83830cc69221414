"use strict";
(() => {
  const figures = JSON.parse(document.getElementById("draft-figures").textContent);
  const config = { responsive: true, displaylogo: false, plotlyServerURL: "", topojsonURL: "",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  for (const [name, figure] of Object.entries(figures)) {
    Plotly.newPlot(`plot-${name}`, figure.data, figure.layout, config);
  }
  // Paper is narrower than a screen: plots are drawn again for it.
  const redraw = (change) => Object.keys(figures).forEach((name) => Plotly.relayout(`plot-${name}`, change));
  addEventListener("beforeprint", () => redraw({ width: 700, autosize: false }));
  addEventListener("afterprint", () => redraw({ width: null, autosize: true }));
})();

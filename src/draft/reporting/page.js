"use strict";
(() => {
  const figures = JSON.parse(document.getElementById("draft-figures").textContent);
  const config = { responsive: true, displaylogo: false, plotlyServerURL: "", topojsonURL: "",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  // The scene fits a panel 2.6 times as wide as high; a narrower one shows it smaller.
  const shrink = (layout, panel) => {
    const aspect = panel.clientWidth / panel.clientHeight;
    if (!layout.scene || aspect >= 2.6) return;
    for (const axis of ["x", "y", "z"]) layout.scene.aspectratio[axis] *= aspect / 2.6;
  };
  for (const [name, figure] of Object.entries(figures)) {
    const panel = document.getElementById(`plot-${name}`);
    shrink(figure.layout, panel);
    Plotly.newPlot(panel, figure.data, figure.layout, config);
  }
  // Paper is narrower than a screen: flat plots are drawn again for it, the scene is scaled.
  const flat = Object.keys(figures).filter((name) => !figures[name].layout.scene);
  const redraw = (change) => flat.forEach((name) => Plotly.relayout(`plot-${name}`, change));
  addEventListener("beforeprint", () => redraw({ width: 700, autosize: false }));
  addEventListener("afterprint", () => redraw({ width: null, autosize: true }));
})();

"use strict";
(() => {
  const figures = JSON.parse(document.getElementById("draft-figures").textContent);
  const config = { responsive: true, displaylogo: false, plotlyServerURL: "", topojsonURL: "",
    modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] };
  // The camera stands far enough away for a panel 2.6 times as wide as high; further for others.
  const stepBack = (layout, panel) => {
    const aspect = panel.clientWidth / panel.clientHeight;
    const eye = layout.scene && layout.scene.camera.eye;
    if (!eye || aspect >= 2.6) return;
    for (const axis of ["x", "y", "z"]) eye[axis] *= 2.6 / aspect;
  };
  for (const [name, figure] of Object.entries(figures)) {
    const panel = document.getElementById(`plot-${name}`);
    stepBack(figure.layout, panel);
    Plotly.newPlot(panel, figure.data, figure.layout, config);
  }
})();

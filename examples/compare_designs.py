"""Compare designs by what they can do without learning.

Metrics are closed-form numbers of a design; `draft metrics` lists them with formulas and sources.
"""

import matplotlib.pyplot as plt

import draft
from draft import plotting

NAMES = ("jump_height", "top_speed", "payload_rated", "cost_of_standing", "impact_mitigation")
spec = draft.load("quadruped")
designs = ("cheetah", "bear", "giraffe")
found = {name: draft.metrics.of_model(spec.resolve(name).build(), NAMES) for name in designs}

plt.style.use(plotting.STYLE)
figure, panels = plt.subplots(1, len(NAMES), figsize=(7.2, 1.9))
for axes, name in zip(panels, NAMES, strict=True):
    metric = draft.metrics.METRICS[name]
    values = [found[design][name] for design in designs]
    axes.bar(designs, values, color=[plotting.BLUE, plotting.ORANGE, plotting.GREEN])
    unit = "" if metric.unit == "1" else f" [{metric.unit}]"
    axes.set_title(f"{name.replace('_', ' ')}{unit}")
    print(f"{metric.doc} {', '.join(f'{value:.3g}' for value in values)}")
figure.savefig("compare_designs.png", dpi=200)

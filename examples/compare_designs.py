"""Compare designs by what they can do without learning.

Metrics are closed-form numbers of a design; `draft metrics` lists them with formulas and sources.
"""

import matplotlib.pyplot as plt

import draft

NAMES = ("jump_height", "top_speed", "payload_rated", "cost_of_standing", "impact_mitigation")
spec = draft.load("quadruped")
designs = ("cheetah", "bear", "giraffe")
found = {name: draft.metrics.of_model(spec.resolve(name).build(), NAMES) for name in designs}

figure, panels = plt.subplots(1, len(NAMES), figsize=(11, 3.2), layout="constrained")
for axes, name in zip(panels, NAMES, strict=True):
    metric = draft.metrics.METRICS[name]
    values = [found[design][name] for design in designs]
    axes.bar(designs, values, color=["#2f6db5", "#c65d21", "#4d9a55"])
    unit = "" if metric.unit == "1" else f" [{metric.unit}]"
    axes.set_title(f"{name.replace('_', ' ')}{unit}", fontsize=9)
    axes.tick_params(labelsize=8)
    print(f"{metric.doc} {', '.join(f'{value:.3g}' for value in values)}")
figure.savefig("compare_designs.png", dpi=100)

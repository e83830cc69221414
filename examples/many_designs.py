"""Resolve a hundred thousand designs in one call.

Arrays in place of numbers give N designs at once: every number that depends on them is an array.
"""

import matplotlib.pyplot as plt
import numpy as np

import draft
from draft import plotting

rng = np.random.default_rng(0)
n = 100_000
designs = draft.load("quadruped").resolve(
    {
        "thigh_length": rng.uniform(0.15, 0.6, n),
        "shank_length": rng.uniform(0.15, 0.6, n),
        "actuators.leg.peak_torque": np.exp(rng.uniform(np.log(30), np.log(400), n)),
    }
)
print(f"{len(designs)} designs, {designs.accepted.mean():.0%} accepted")
light = designs[designs.accepted & (designs.mass < 30)]
print(f"{len(light)} of them below 30 kg; the first: {light[0]}")

found = draft.metrics.of_design(designs, ["leg_length", "mass"])
plt.style.use(plotting.STYLE)
figure, axes = plt.subplots(figsize=(3.5, 2))
for accepted, label, colour in (
    (True, "accepted", plotting.BLUE),
    (False, "refused", plotting.ORANGE),
):
    rows = np.flatnonzero(designs.accepted == accepted)[:4000]
    axes.scatter(
        found["leg_length"][rows], found["mass"][rows], s=0.5, color=colour, label=label, alpha=0.5
    )
axes.set(xlabel="thigh plus shank [m]", ylabel="mass [kg]")
plotting.logarithmic(axes.yaxis)
axes.legend(markerscale=6)
figure.savefig("many_designs.png", dpi=220)

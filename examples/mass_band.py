"""Draw the error band of a mass over the length of the thigh.

Masses are predicted by trends, and the trends have errors: a band of 90 % holds nine in ten real
robots of such a design. A motor that is measured narrows it a little; most of it is the trunk.
"""

import matplotlib.pyplot as plt
import numpy as np

import draft
from draft import plotting

spec = draft.load("quadruped")
lengths = np.linspace(0.15, 0.5, 40)
predicted = spec.resolve({"thigh_length": lengths, "actuators.leg.like": None})
measured = spec.resolve({"thigh_length": lengths})

plt.style.use(plotting.STYLE)
figure, axes = plt.subplots(figsize=(4, 2.3))
for designs, label, colour in (
    (predicted, "motor predicted from its torque", plotting.ORANGE),
    (measured, "motor from the catalogue", plotting.BLUE),
):
    low, high = designs.mass_band(0.9)
    axes.fill_between(lengths, low, high, alpha=0.25, color=colour)
    axes.plot(lengths, designs.mass, color=colour, label=label)
    print(f"{label}: {designs.mass[0]:.1f} kg, band {low[0]:.1f} to {high[0]:.1f} kg")
axes.set(xlabel="length of the thigh [m]", ylabel="mass with its 90 % band [kg]")
figure.legend(loc="outside upper center", ncols=2)
figure.savefig("mass_band.png", dpi=220)

"""Build a robot and see where its mass is.

A spec is read, resolved to numbers and compiled. `model.mujoco` is an ordinary mujoco.MjModel.
"""

import matplotlib.pyplot as plt

import draft
from draft import plotting

spec = draft.load("quadruped")
design = spec.resolve("bear", {"thigh_length": 0.38})  # a named design, and values that override
model = design.build()
print(design)
print(f"MuJoCo: {model.mujoco.nbody} bodies, {model.mujoco.nv} degrees of freedom")
low, high = design.mass_band(0.9)
print(f"mass {design.mass:.1f} kg; nine in ten such robots have {low:.0f} to {high:.0f} kg")

shares = {
    name: mass
    for name, mass in design.body_masses().items()
    if name == "trunk" or name.startswith("FL_")
}
plt.style.use(plotting.STYLE)
figure, axes = plt.subplots(figsize=(3.5, 1.75))
axes.barh(list(shares), list(shares.values()), color=plotting.BLUE)
axes.set_xlabel("mass [kg], one leg and the trunk")
axes.invert_yaxis()
figure.savefig("build_robot.png", dpi=220)

"""See what a motor weighs, and how much inertia it reflects, over its torque.

Two stated numbers describe a motor; trends fitted to real modules predict the others. Mass follows
the torque alone; the armature falls with the speed, since a faster motor is geared less.
"""

import matplotlib.pyplot as plt
import numpy as np

import draft
from draft import plotting

spec = draft.load("hopper")
torques = np.geomspace(10, 300, 60)  # [N m]
plt.style.use(plotting.STYLE)
figure, (left, right) = plt.subplots(1, 2, figsize=(4, 1.8))
for speed, colour in ((10, plotting.BLUE), (25, plotting.ORANGE)):  # [rad/s]
    designs = spec.resolve(
        {"actuators.leg.peak_torque": torques, "actuators.leg.no_load_speed": speed}
    )
    motor = designs.actuators["leg"]
    band = designs.actuator_bands(0.9)["leg"]
    panels = ((left, "mass"), (right, "armature")) if speed == 10 else ((right, "armature"),)
    for axes, quantity in panels:
        axes.fill_between(torques, *band[quantity], color=colour, alpha=0.2)
        axes.plot(torques, getattr(motor, quantity), color=colour, label=f"{speed} rad/s")
    print(f"{speed} rad/s: {motor.mass[0]:.2f} to {motor.mass[-1]:.2f} kg")
plotting.decorate(left, "peak torque [N m]", "mass [kg]")
plotting.decorate(right, "peak torque [N m]", "armature [kg m²]")
right.legend(title="no-load speed")
figure.savefig("motor_trends.png", dpi=220)

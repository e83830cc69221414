"""Drop a robot onto the floor and see whether its servos hold it.

`model.scene()` adds a floor, position servos and the home pose to the robot.
"""

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import draft
from draft import plotting

plt.style.use(plotting.STYLE)
figure, axes = plt.subplots(figsize=(3.5, 2.0))
for name, colour in (
    ("cheetah", plotting.BLUE),
    ("bear", plotting.ORANGE),
    ("giraffe", plotting.GREEN),
):
    design = draft.load("quadruped").resolve(name)
    model = design.build().scene()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)  # the home pose, with servos that hold it
    stance = data.qpos[2]
    data.qpos[2] += 0.10  # 10 cm above the floor
    times, heights = [], []
    while data.time < 2.0:
        mujoco.mj_step(model, data)
        times.append(data.time)
        heights.append(data.qpos[2] - stance)
    print(f"{name}: sinks to {min(heights):+.3f} m, ends at {heights[-1]:+.3f} m")
    axes.plot(times, np.array(heights), color=colour, label=f"{name}, {design.mass:.0f} kg")
axes.axhline(0.0, color="0.6", linewidth=0.8)
axes.set(xlabel="time [s]", ylabel="trunk above home height [m]")
axes.legend()
figure.savefig("drop_test.png", dpi=220)

"""Sample where a foot can reach.

Poses are drawn evenly from the ranges of the joints; MuJoCo's kinematics give the foot's place.
"""

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import draft
from draft import plotting

design = draft.load("quadruped").resolve("cheetah")
model = design.build().mujoco
data = mujoco.MjData(model)
leg = ("FL_hip_roll", "FL_hip_pitch", "FL_knee")
joints = [model.joint(name) for name in leg]
rng = np.random.default_rng(0)
feet = np.empty((5000, 3))
for foot in feet:
    for joint in joints:
        data.qpos[joint.qposadr[0]] = rng.uniform(*joint.range)
    mujoco.mj_kinematics(model, data)
    foot[:] = data.site("FL_foot").xpos - data.body("FL_lateral_thigh").xpos
print(f"the foot reaches {np.linalg.norm(feet, axis=1).max():.2f} m from the hip")

plt.style.use(plotting.STYLE)
figure, (side, front) = plt.subplots(1, 2, figsize=(4, 2), sharey=True)
side.scatter(feet[:, 0], feet[:, 2], s=0.5, color=plotting.BLUE)
front.scatter(feet[:, 1], feet[:, 2], s=0.5, color=plotting.ORANGE)
side.set(xlabel="forward [m]", ylabel="up [m]", aspect="equal", title="from the side")
front.set(xlabel="left [m]", aspect="equal", title="from the front")
figure.savefig("leg_workspace.png", dpi=220)

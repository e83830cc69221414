"""Compare the joint-space inertia of a leg with and without its rotors.

Geared rotors weigh little and reflect much: their inertia grows with the square of the reduction.
"""

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import draft
from draft import plotting

plt.style.use(plotting.STYLE)
figure, panels = plt.subplots(1, 3, figsize=(5.2, 2.1))
for axes, name in zip(panels, ("cheetah", "bear", "giraffe"), strict=True):
    design = draft.load("quadruped").resolve(name)
    model = design.build().mujoco
    data = mujoco.MjData(model)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, inertia)
    joints = ("FL_hip_roll", "FL_hip_pitch", "FL_knee")
    dofs = [model.joint(joint).dofadr[0] for joint in joints]
    total, rotors = np.diag(inertia)[dofs], model.dof_armature[dofs]
    print(f"{name}: rotors are {np.round(rotors / total * 100)} % of the inertia")
    axes.bar(range(3), total - rotors, color=plotting.BLUE, label="links and housings")
    axes.bar(range(3), rotors, bottom=total - rotors, color=plotting.ORANGE, label="rotors")
    axes.set_xticks(range(3), ["hip roll", "hip pitch", "knee"])
    axes.set(title=f"{name}, {design.actuators['leg'].gear_ratio:.0f} : 1")
panels[0].set_ylabel("M(q), diagonal [kg m2]")
figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
figure.savefig("mass_matrix.png", dpi=220)

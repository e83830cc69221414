"""Make a thousand MuJoCo models without a thousand compiles.

Models of one topology differ in numbers only. `build_batch` computes those by arrays, some fifty
times as fast as compiling; `write` puts those of one design into a model that exists.
"""

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import draft
from draft import plotting

n = 1000
rng = np.random.default_rng(0)
designs = draft.load("quadruped").resolve(
    {"thigh_length": rng.uniform(0.2, 0.4, n), "shank_length": rng.uniform(0.2, 0.4, n)}
)
batch = designs.build_batch()
print(f"{len(batch)} models, {batch.nbytes / 1e6:.1f} MB")

model = batch.model(0)
data = mujoco.MjData(model)
falls = np.empty(len(batch))
for k in range(len(batch)):
    batch.write(k, model)
    mujoco.mj_setConst(model, data)
    mujoco.mj_resetData(model, data)
    data.qpos[7:] = 0.3
    mujoco.mj_forward(model, data)
    falls[k] = data.joint("FL_knee").qfrc_bias[0]  # torque of gravity on the knee [N m]
thigh, shank = (designs.parameters[name][batch.rows] for name in ("thigh_length", "shank_length"))
plt.style.use(plotting.STYLE)
figure, axes = plt.subplots(figsize=(3, 2))
shown = axes.scatter(thigh, shank, c=np.abs(falls), s=2)
figure.colorbar(shown, label="torque of a lifted shank [N m]")
axes.set(xlabel="thigh [m]", ylabel="shank [m]")
figure.savefig("batch_of_models.png", dpi=220)

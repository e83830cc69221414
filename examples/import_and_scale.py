"""Import a robot that exists and give it other legs.

Joints, ranges, torques and lengths are the maker's; masses are predicted, so that they follow.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import draft
from draft import plotting

FILE = Path(__file__).parent / "descriptions" / "unitree_go2" / "go2.urdf"
with TemporaryDirectory() as folder:
    spec = draft.import_robot(FILE, Path(folder) / "go2").spec
design = spec.resolve()
print(design, "as imported; its maker states 16.1 kg")

lengths = np.linspace(0.15, 0.40, 60)
many = spec.resolve({"thigh_length": lengths})
found = draft.metrics.of_design(many, ["jump_height"])
plt.style.use(plotting.STYLE)
figure, (left, right) = plt.subplots(1, 2, figsize=(4, 1.8))
low, high = many.mass_band(0.9)
left.fill_between(lengths, low, high, alpha=0.2)
left.plot(lengths, many.mass)
left.set(xlabel="thigh [m]", ylabel="mass with its 90 % band [kg]")
right.plot(lengths, found["jump_height"], color=plotting.ORANGE)
right.set(xlabel="thigh [m]", ylabel="jump height [m]")
for axes in (left, right):
    axes.axvline(float(design.parameters["thigh_length"]), color=plotting.GREY, linestyle="--")
figure.savefig("import_and_scale.png", dpi=220)

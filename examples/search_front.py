"""Search for robots that no other beats in mass and jump height.

`draft.optimise` drives Optuna over any numbers of a spec; the front is saved as named designs.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt

import draft
from draft import plotting

with TemporaryDirectory() as folder:
    front = draft.optimise(
        "quadruped",
        vary={
            "thigh_length": (0.15, 0.6),
            "shank_length": (0.15, 0.6),
            "actuators.leg.peak_torque": (40, 150),
        },
        minimise=["mass"],
        maximise=["jump_height"],
        subject_to=["accepted", "payload_rated > 20"],
        trials=150,
        out=Path(folder) / "search",
    )
print(front)
masses = [entry["goals"]["mass"] for entry in front]
heights = [entry["goals"]["jump_height"] for entry in front]
print(
    f"from {masses[0]:.1f} kg and {heights[0]:.2f} m to {masses[-1]:.1f} kg and {heights[-1]:.2f} m"
)
plt.style.use(plotting.STYLE)
figure, axes = plt.subplots(figsize=(3, 2))
axes.plot(masses, heights, "o-", markersize=3, color=plotting.BLUE)
axes.set(xlabel="mass [kg]", ylabel="jump height [m]")
figure.savefig("search_front.png", dpi=220)

"""An exporter."""

from __future__ import annotations

from draft.extend import Model, exporter


@exporter("bodies.csv")
def bodies(model: Model) -> dict[str, str]:
    """Table of the bodies: name, mass [kg] and centre of mass in the frame of the body [m]."""
    lines = ["name,mass,x,y,z"]
    for body in range(1, model.mujoco.nbody):  # 0 is the world
        numbers = [model.mujoco.body_mass[body], *model.mujoco.body_ipos[body]]
        lines.append(",".join([model.mujoco.body(body).name, *(f"{x:.6g}" for x in numbers)]))
    return {"bodies.csv": "\n".join(lines) + "\n"}

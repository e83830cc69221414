"""A shipped policy in plain MuJoCo, with NumPy alone: python examples/run_policy.py cheetah 2.5.

`draft build quadruped --design cheetah --out cheetah` writes the robot.xml that is stepped here.
`draft.learn.policy.controller.Controller` does the same for any model, and sees steps too.
"""

import sys

import mujoco
import numpy as np

import draft
from draft.design.references import open_design
from draft.model.scene import home_position

name, speed = sys.argv[1:3] if len(sys.argv) > 2 else ("cheetah", 2.5)  # or humanoid 0.5 [m/s]
policy = draft.policy(name, "run")
design = open_design(name)
command = np.array([float(speed), 0.0, 0.0])

spec = mujoco.MjSpec.from_string(design.build().xml)  # or MjSpec.from_file("cheetah/robot.xml")
spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 1))
spec.option.timestep = policy.timestep
spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
model = spec.compile()
data = mujoco.MjData(model)
data.qpos[:] = home_position(design)
data.qpos[7:] += np.random.default_rng(0).uniform(-0.1, 0.1, len(policy.home))

action, trim = np.zeros(len(policy.home)), np.zeros(5)
while data.time < 10.0:
    mujoco.mj_forward(model, data)
    linear, angular = data.sensor("imu_lin_vel").data, data.sensor("imu_ang_vel").data
    observation = (
        linear,  # [m/s], in the trunk's frame
        angular,  # [rad/s]
        policy.trim.gravity(-data.xmat[1][6:], trim),  # in the trunk's frame
        data.qpos[7:] - policy.home,  # [rad]
        data.qvel[6:],  # [rad/s]
        action,  # the last one
        policy.trim.command(command, trim),  # vx, vy [m/s], wz [rad/s]
    )
    action = policy(np.concatenate(observation))
    moving = (*linear[:2], angular[2])  # The policy of all legs adds up by how much it misses.
    trim = policy.trim.next(trim, command, moving, policy.control_period)
    for _ in range(round(policy.control_period / policy.timestep)):
        data.qfrc_applied[6:] = policy.torque(action, data.qpos[7:], data.qvel[6:])
        mujoco.mj_step(model, data)
print(f"{data.qpos[0]:.1f} m in {data.time:.0f} s, trunk {data.qpos[2]:.2f} m above the ground")

"""A shipped policy in plain MuJoCo, with NumPy alone: python examples/run_policy.py 2.5 [m/s].

`draft build quadruped --design cheetah --out cheetah` writes the robot.xml that is stepped here.
`draft.learn.policy.controller.Controller` does the same for any model, and sees steps too.
"""

import sys

import mujoco
import numpy as np

import draft

command = np.array([float(sys.argv[1]) if len(sys.argv) > 1 else 2.5, 0.0, 0.0])
policy = draft.policy("cheetah", "run")
robot = draft.load("quadruped").resolve("cheetah").build()

spec = mujoco.MjSpec.from_string(robot.xml)  # or MjSpec.from_file("cheetah/robot.xml")
spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 1))
spec.option.timestep = policy.timestep
spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
model = spec.compile()
data = mujoco.MjData(model)
data.qpos[2] = 0.46
data.qpos[7:] = policy.home + np.random.default_rng(0).uniform(-0.1, 0.1, 12)

action = np.zeros(12)
while data.time < 10.0:
    mujoco.mj_forward(model, data)
    observation = (
        data.sensor("imu_lin_vel").data,  # [m/s], in the trunk's frame
        data.sensor("imu_ang_vel").data,  # [rad/s]
        -data.body("trunk").xmat[6:],  # gravity's direction in the trunk's frame
        data.qpos[7:] - policy.home,  # [rad]
        data.qvel[6:],  # [rad/s]
        action,  # the last one
        command,  # vx, vy [m/s], wz [rad/s]
    )
    action = policy(np.concatenate(observation))
    for _ in range(round(policy.control_period / policy.timestep)):
        data.qfrc_applied[6:] = policy.torque(action, data.qpos[7:], data.qvel[6:])
        mujoco.mj_step(model, data)
print(f"{data.qpos[0]:.1f} m in {data.time:.0f} s, trunk {data.qpos[2]:.2f} m above the ground")

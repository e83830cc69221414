"""Recipes: sets of numbers to train with, for different machines.

`paper` is the published configuration, for a GPU: some hundred million steps per stage. `laptop`
learns from a hundredth of them; it changes only the numbers below, each for the reason given.
`tune` is `laptop` for policies that can run already, such as that of a family with one more body.
`any` trains one policy for robots of any legs. `machine` is for policies of real robots, which also
start from one that can run: they observe what an inertial sensor and encoders give, and meet a
machine that is not the model.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

from draft.learn.task.config import Config
from draft.learn.task.constants import JOINTS, MOST_ITERATIONS
from draft.learn.task.stages import PUBLISHED, STAGES

RecipeName = Literal["paper", "laptop", "tune", "any", "machine"]


_POWER = 1.5  # Power of the joints with which iterations grow.


class Change(NamedTuple):
    """A number that a recipe changes.

    Attributes:
        value: the new number.
        why: reason for it.
    """

    value: Any
    why: str


@dataclass(frozen=True)
class Recipe:
    """A set of numbers.

    Attributes:
        name: its name.
        changes: numbers that differ from `Config()`, by GROUP.NAME.
        plane: whether stages that do not need uneven ground use a plane.
    """

    name: RecipeName
    changes: Mapping[str, Change] = field(default_factory=dict)
    plane: bool = False

    @property
    def config(self) -> Config:
        """All numbers."""
        return Config().with_values({name: change.value for name, change in self.changes.items()})

    def for_joints(self, joints: int) -> Recipe:
        """The recipe for a robot of so many joints: more than twelve take more iterations.

        Their number grows with the power 1.5 of the joints. A humanoid of 29 joints walks as asked
        after 800 to 1000 iterations of `laptop`, a quadruped of 12 after 250.
        """
        if joints <= JOINTS:
            return self
        changes = dict(self.changes)
        for stage in PUBLISHED:
            number, usual = f"learning.iterations_{stage.name}", self.config.iterations(stage.name)
            count = min(MOST_ITERATIONS, round(usual * (joints / JOINTS) ** _POWER))
            changes[number] = Change(count, f"{usual} x ({joints} joints / {JOINTS})^{_POWER}")
        return replace(self, changes=changes)

    def ground(self, stage: str) -> str:
        """Ground of a stage: "uneven" or "flat"."""
        return "uneven" if STAGES[stage].uneven or not self.plane else "flat"

    def stages(self) -> list[str]:
        """Stages that it is for: `any` has a recipe of its own."""
        return [name for name in STAGES if (name == "any") == (self.name == "any")]

    def source(self, name: str) -> str | None:
        """Source of a number that the recipe changes; None for other numbers."""
        return f"choice: {self.name}" if name in self.changes else None


LAPTOP = Recipe(
    "laptop",
    {
        "learning.environments": Change(512, "3072 samples of all cores per gradient step"),
        "learning.hidden": Change((256, 128, 64), "three times as fast as 512-256-128 on a CPU"),
        "learning.mirror": Change(True, "each sample trains both sides, at no cost"),
        "learning.initial_std": Change(1.0, "with 0.5 the robot learns to stand still"),
        "learning.kl": Change(0.015, "small batches need larger steps"),
        "learning.least_rate": Change(2e-4, "small batches drive the adaptive rate to zero"),
        "learning.decay": Change(0.3, "the last steps no longer explore: seeds come nearer"),
        "learning.save_every": Change(25, "some fifteen seconds"),
        "learning.iterations_base": Change(
            250, "3.1 million steps: the giraffe needs most of them"
        ),
        "learning.iterations_velocity": Change(250, "3.1 million steps"),
        "learning.iterations_terrain": Change(300, "3.7 million steps"),
        "learning.iterations_push": Change(250, "3.1 million steps"),
        "rewards.action_rate_ramp": Change(100, "with the full weight it learns to stand still"),
        "episodes.joints": Change(0.1, "a symmetric policy needs an asymmetric start"),
        "episodes.contact_time": Change((0.01, 0.01), "a gait of softer feet fails on hard ground"),
        "episodes.delay": Change((0.0, 0.015), "targets reach real motors late"),
        "episodes.motor": Change((0.95, 1.05), "no two motors are alike"),
        "episodes.joint_friction": Change((0.0, 0.02), "no joint is free of it"),
        "velocity.growth": Change(0.2, "commands grow as fast as the robot learns"),
        "velocity.missed": Change(0.7, "commands grow past what the body can do"),
        "velocity.relative": Change(0.2, "a width per top speed rewards running too slowly"),
        "velocity.action_rate_weight": Change(-0.02, "torques chatter with -0.01"),
        "push.ramp": Change(
            ((0, 2.0), (30, 3.0), (60, 4.0), (90, 5.0)),
            "up to the published size, as fast as a walking policy can learn",
        ),
        "ground.rows": Change(7, "steps of 0.05 to 0.20 m, each 0.025 m higher"),
        "terrain.step": Change(
            (0.05, 0.20), "half of the published heights take ten times as long"
        ),
        "terrain.stairs": Change(0.8, "the evaluation measures stairs"),
        "terrain.pits": Change(0.75, "climbing takes longer to learn than descending"),
        "terrain.flat": Change(0.1, "the policy must not forget to walk on a plane"),
        "terrain.slopes": Change(0.0, "height fields are slow"),
        "terrain.waves": Change(0.0, "height fields are slow"),
        "terrain.start_rows": Change(2, "steps that the base policy can learn"),
        "terrain.by_way": Change(True, "a robot that turns back on stairs does not move up"),
        "terrain.forward": Change((0.5, 1.1), "a fixed heading leads over the stairs"),
        "terrain.away": Change(0.8, "the others keep turning and walking backwards"),
        "terrain.progress": Change(1.0, "a robot that stands keeps all other rewards"),
        "terrain.episode": Change(7.0, "time to leave a patch; rows change sooner"),
    },
    plane=True,
)
TUNE = Recipe(
    "tune",
    {
        **LAPTOP.changes,
        "learning.iterations_velocity": Change(125, "a quarter of base and velocity together"),
        "learning.learning_rate": Change(3e-4, "first steps that do not undo what it can do"),
        "learning.least_rate": Change(1e-4, "as small as the policy's change requires"),
        "learning.entropy": Change(0.003, "it need not explore other gaits"),
        "rewards.power_weight": Change(-0.1, "without it gaits draw a fifth more power again"),
        "terrain.clearance": Change(0.18, "feet that rise as on a plane meet higher steps"),
        "terrain.clearance_share": Change(0.5, "to climb counts more than how the feet move"),
        "terrain.progress": Change(2.5, "with 1 robots stand still before a step"),
    },
    LAPTOP.plane,
)
ANY = Recipe(
    "any",
    {
        **LAPTOP.changes,
        "learning.environments": Change(256, "more worlds learn less from each step"),
        "learning.iterations_any": Change(4000, "24.6 million steps"),
        "learning.kl": Change(0.03, "it is a sum over up to 29 joints"),
        "learning.least_rate": Change(1e-4, "with 2e-4 steps are twice as large as that asks"),
        "learning.entropy": Change(0.001, "it is a sum over up to 29 joints"),
        "actuation.support": Change(0.6, "gains by the motor alone let weak robots sink and fall"),
        "velocity.forward": Change(6.5, "3 sqrt(g L); the robots end the growth before"),
        "velocity.sideways": Change(0.5, "0.23 sqrt(g L)"),
        "velocity.turn": Change(1.5, "0.33 sqrt(g / L)"),
        "velocity.growth": Change(0.05, "commands grow as fast as the worst cell learns"),
        "velocity.missed": Change(0.6, "commands grow past what a body can do"),
        "velocity.progress": Change(1.0, "a robot that stands keeps all other rewards"),
        "velocity.turning": Change(2.5, "with 0.7 no robot turned after 2.4 million steps"),
        "velocity.single": Change(0.45, "a robot that walks ahead keeps most of the tracking"),
        "rewards.linear_weight": Change(2.0, "a robot that stands keeps all other rewards"),
        "velocity.pushed": Change(0.15, "one policy also learns to survive kicks"),
        "push.ramp": Change(
            ((0, 1.0), (600, 2.5)), "quadrupeds that are kicked hard splay their legs, and shuffle"
        ),
        "episodes.centre": Change(0.03, "computers, batteries and heads weigh what no spec says"),
        "observations.linear_velocity_noise": Change(0.1, "odometry of legs errs by as much"),
        "rewards.linear_sigma": Change(0.4, "slow commands are followed, not ignored"),
        "rewards.angular_sigma": Change(1.0, "roll and pitch rates of a gait hide the turn"),
        "rewards.power_weight": Change(-0.05, "joints that shake cost power"),
    },
    LAPTOP.plane,
)
MACHINE = Recipe(
    "machine",
    {
        **LAPTOP.changes,
        "observations.linear_velocity": Change(False, "no sensor of a robot gives it"),
        "observations.history": Change(5, "0.1 s: the velocity, and the machine, show in it"),
        "observations.biased_encoders": Change(True, "a controller sees what its encoders give"),
        "episodes.encoder": Change(0.03, "joints that were set by hand"),
        "episodes.delay": Change((0.0, 0.02), "bus, computer and drives, up to a whole period"),
        "episodes.motor": Change((0.9, 1.1), "torque constants and gains as they are measured"),
        "episodes.joint_friction": Change((0.0, 0.04), "gearboxes, cold and warm"),
        "episodes.dry_friction": Change((0.0, 0.03), "gearboxes, cold and warm"),
        "velocity.pushed": Change(0.3, "one policy runs and survives kicks"),
        "learning.lessons": Change(80, "1 million steps: it runs as its teacher does"),
        "learning.iterations_velocity": Change(300, "it learns to feel its velocity too"),
        "learning.least_rate": Change(1e-4, "as small as the policy's change requires"),
        "learning.entropy": Change(0.003, "it need not explore other gaits"),
    },
    LAPTOP.plane,
)
RECIPES = {recipe.name: recipe for recipe in (Recipe("paper"), LAPTOP, TUNE, ANY, MACHINE)}


def default(devices: Sequence[str]) -> Recipe:
    """Return the recipe for devices: `laptop` on a CPU, `paper` on GPUs."""
    return RECIPES["laptop" if list(devices) == ["cpu"] else "paper"]

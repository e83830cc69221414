"""`draft train`: teach a quadruped to walk, in slices of time if need be."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from draft.cli.options import check_folder, parse_values
from draft.errors import DraftError, Problem
from draft.extras import need
from draft.files import lock
from draft.learn.quiet import quiet

if TYPE_CHECKING:
    from draft.learn.run import Origin, Plan, Run

SCRATCH = "scratch"


def main(
    designs: Annotated[
        tyro.conf.Positional[tuple[str, ...]],
        tyro.conf.arg(
            metavar="DESIGN",
            help="A shipped design (cheetah), SPEC, SPEC:DESIGN, SPEC:FILE.yaml, a built model's "
            "folder, or a run's to go on with. Several train one policy in one simulation.",
        ),
    ],
    /,
    stage: Annotated[
        Literal["base", "velocity", "terrain", "push"],
        tyro.conf.arg(help="The curriculum; all but base start from a base policy."),
    ] = "base",
    seed: Annotated[int, tyro.conf.arg(metavar="N", help="Of everything random.")] = 0,
    origin: Annotated[
        str | None,
        tyro.conf.arg(
            name="from",
            metavar="RUN",
            help="Run whose policy it starts from, or 'scratch'.",
            help_behavior_hint="(default for later stages: the base run beside it)",
        ),
    ] = None,
    iterations: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Iterations in all slices.",
            help_behavior_hint="(default: the stage's)",
        ),
    ] = None,
    minutes: Annotated[
        float | None,
        tyro.conf.arg(
            metavar="M",
            help="Stop after so long; the same command goes on.",
            help_behavior_hint="(default: no limit)",
        ),
    ] = None,
    envs: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Worlds at once, on each GPU.",
            help_behavior_hint="(default: 4096)",
        ),
    ] = None,
    values: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            name="set",
            metavar="NAME=VALUE",
            help="Values that win: of the design (thigh_length=0.3), or of the task, as "
            "'draft learn show' lists them (rewards.height=0.4).",
            help_behavior_hint="",
        ),
    ] = (),
    vary: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            metavar="NAME=LOW:HIGH",
            help="Draw a family of designs, such as thigh_length=0.2:0.4, with --bodies.",
            help_behavior_hint="",
        ),
    ] = (),
    bodies: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N", help="How many designs to draw.", help_behavior_hint="(with --vary)"
        ),
    ] = None,
    flat: Annotated[bool, tyro.conf.arg(help="Train on a plane; no height map is read.")] = False,
    see_design: Annotated[
        bool, tyro.conf.arg(help="Let the policy see what tells designs apart.")
    ] = False,
    device: Annotated[
        str,
        tyro.conf.arg(help="auto, cpu, cuda, cuda:1, all, or numbers of GPUs such as 0,1."),
    ] = "auto",
    wandb: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="PROJECT",
            help="Log to Weights & Biases too.",
            help_behavior_hint="(default: TensorBoard alone)",
        ),
    ] = None,
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="The run's folder.",
            help_behavior_hint="(default: runs/DESIGN-STAGE-SEED)",
        ),
    ] = None,
) -> int:
    """Train a quadruped's policy; the same command goes on where it stopped."""
    begun = time.monotonic()
    check_folder(out)
    _check(seed, iterations, minutes, envs)
    from draft.learn.devices import devices
    from draft.learn.run import is_run, open_run

    if len(designs) == 1 and is_run(Path(designs[0])):
        run = open_run(Path(designs[0]))
    else:
        texts, plan = _plan(designs, (vary, bodies), values, stage, seed, envs, flat, see_design)
        folder = Path(out) if out else Path("runs") / _name(plan, designs)
        devices(device)  # Before anything is written.
        run = _run(folder, plan, texts, origin)
    total = iterations or run.plan.config.learning.iterations(run.plan.stage)
    return _train(run, total, minutes, begun, device, wandb)


def _check(seed: int, iterations: int | None, minutes: float | None, envs: int | None) -> None:
    """Refuse numbers that make no sense."""
    for name, value, most in (
        ("iterations", iterations, 10**7),
        ("envs", envs, 10**6),
        ("minutes", minutes, 10**6),
    ):
        if value is not None and not 0 < value <= most:
            cause = f"--{name} {value} is not above 0 and at most {most}"
            raise DraftError(Problem(cause, None, "leave it away for the default"))
    if not 0 <= seed < 2**31:
        raise DraftError(Problem(f"--seed {seed} is not from 0 to 2**31 - 1", None, "such as 0"))


def _plan(
    words: tuple[str, ...],
    varied: tuple[tuple[str, ...], int | None],
    values: tuple[str, ...],
    stage: str,
    seed: int,
    envs: int | None,
    flat: bool,
    see_design: bool,
) -> tuple[dict[str, str], Plan]:
    """What the command line asks for, and the designs as files."""
    from draft.cli.bodies import members
    from draft.learn.config import Config
    from draft.learn.run import Plan
    from draft.model.folder import design_text

    groups = tuple(f"{name}." for name in Config().as_dict())
    numbers = tuple(word for word in values if word.strip().startswith(groups))
    of_design = tuple(word for word in values if word not in numbers)
    config = Config().with_values(parse_values(numbers))
    designs, family = members(words, *varied, of_design, seed)
    environments = envs or config.learning.environments
    if environments < len(family):
        cause = f"{environments} worlds cannot hold {len(family)} designs"
        raise DraftError(Problem(cause, None, f"give --envs {len(family)} or more"))
    return {m.name: design_text(d) for m, d in zip(family, designs, strict=True)}, Plan(
        members=family,
        stage=stage,
        seed=seed,
        environments=environments,
        config=config,
        ground="flat" if flat else "uneven",
        see_design=see_design,
    )


def _name(plan: Plan, words: tuple[str, ...]) -> str:
    """Name of a run's folder."""
    count = len(plan.members)
    name = words[0].rstrip("/").rpartition("/")[2].replace(":", "-")
    if count == 1:
        name = plan.members[0].name.rpartition(":")[2]
    elif len(words) > 1:
        name = f"{name}-and-{count - 1}-more"
    else:
        name = f"{name}-{count}-bodies"
    return f"{name}-{plan.stage}-{plan.seed}"


def _run(folder: Path, plan: Plan, texts: dict[str, str], origin: str | None) -> Run:
    """The run of a folder: the one that is there, if it is of this plan, or a new one."""
    from dataclasses import replace

    from draft.learn.run import check_same, create, is_run, open_run

    if is_run(folder):
        run = open_run(folder)
        # What it started from is settled, unless another is asked for.
        start = run.plan.origin if origin is None else _origin(folder, plan, origin)
        check_same(run, replace(plan, origin=start))
        return run
    return create(folder, replace(plan, origin=_origin(folder, plan, origin)), texts)


def _origin(folder: Path, plan: Plan, word: str | None) -> Origin | None:
    """The run that a stage starts from."""
    from draft.learn.run import Origin, file_digest, is_run, open_run, robots_digest

    if word == SCRATCH or (word is None and plan.stage == "base"):
        return None
    beside = folder.with_name(folder.name.replace(f"-{plan.stage}-", "-base-"))
    source = Path(word) if word else beside
    if word is None and (source == folder or not is_run(source)):
        cause = f"stage {plan.stage} starts from a base policy, and there is no run {beside}"
        remedy = "train the base stage first, name its run with --from RUN, or --from scratch"
        raise DraftError(Problem(cause, None, remedy))
    run = open_run(source)
    if robots_digest(run.plan.members) != robots_digest(plan.members):
        theirs = ", ".join(member.name for member in run.plan.members)
        cause = f"{source} is a run of {theirs}, with other numbers than the design at hand"
        raise DraftError(Problem(cause, None, "name a run of the same design"))
    if run.plan.see_design != plan.see_design:
        cause = f"{source} was trained with{'' if run.plan.see_design else 'out'} --see-design"
        raise DraftError(Problem(cause, None, "do the same here"))
    iteration, file = run.checkpoint()
    return Origin(str(source), iteration, file_digest(file))


def _train(
    run: Run, total: int, minutes: float | None, begun: float, device: str, wandb: str | None
) -> int:
    """Train and tell how far it is."""
    names = ", ".join(member.name for member in run.plan.members[:3])
    names += f" and {len(run.plan.members) - 3} more" if len(run.plan.members) > 3 else ""
    if run.done() >= total and run.checkpoints():
        print(f"{run.folder}: {total} of {total} iterations are done")
        return 0
    print(f"{names}: stage {run.plan.stage}, seed {run.plan.seed}, to {run.folder}")
    quiet()
    need("mjlab", "learn")
    from draft.cli.training import Screen
    from draft.learn.devices import devices
    from draft.learn.lab import launch

    chosen = devices(device)
    if chosen == ["cpu"]:
        print(
            f"on the CPU, {run.plan.environments} worlds: for trying things out; a GPU does a "
            "thousand times as many steps. The first time, kernels are compiled for a minute"
        )
    try:
        with lock(run.folder, "draft train"), Screen(names) as screen:
            until = launch.until(minutes, begun)
            done = launch.train(run, chosen, total, until, screen.tell, wandb)
    except KeyboardInterrupt:
        print(f"{run.done()} of {total} iterations are saved; the same command goes on")
        raise
    at = run.done()
    if done:
        print(f"done: {at} iterations; see it with: draft play {run.folder}")
    else:
        print(f"stopped after {at} of {total} iterations; the same command goes on")
    return 0

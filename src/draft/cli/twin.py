"""`draft twin`: compare a real robot with Draft's prediction of it."""

from __future__ import annotations

import json as json_
import math
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from draft import files
from draft.cli.display.twin_output import print_all, print_one
from draft.cli.explore_options import bar
from draft.cli.interrupted import NOTHING, if_interrupted
from draft.cli.options import (
    DESIGN_FORMS,
    JsonOutput,
    KneeDrive,
    Population,
    Root,
    Speeds,
    Strict,
    Torques,
)
from draft.cli.spelling import spelt
from draft.errors import DraftError
from draft.extras import check as need_installed
from draft.imports.options import Options
from draft.imports.stated import parse

if TYPE_CHECKING:
    from draft.twins import every
    from draft.twins.compare import Comparison


def main(
    file: Annotated[
        tyro.conf.Positional[Path | None],
        tyro.conf.arg(
            metavar="[FILE]",
            help="A robot's URDF, MJCF or xacro file, or its name, such as menagerie:unitree_go2.",
            help_behavior_hint="(required without --all)",
        ),
    ] = None,
    /,
    spec: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DESIGN",
            help=f"The twin: {DESIGN_FORMS}.",
            help_behavior_hint="(default: FILE as 'draft import' turns it into a spec)",
        ),
    ] = None,
    every: Annotated[
        Path | None,
        tyro.conf.arg(
            name="all",
            metavar="DIR|CSV",
            help="Compare every robot of a folder or manifest, each held out of the trends.",
            help_behavior_hint="(default: one FILE)",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Folder for the JSON or CSV table, and the figure (extra figures).",
            help_behavior_hint="(default: no files)",
        ),
    ] = None,
    population: Population = None,
    torque: Torques = (),
    speed: Speeds = (),
    strict: Strict = False,
    knee_drive: KneeDrive = None,
    root: Root = "",
    without: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            metavar="KEY ...",
            help="Surveyed robots to hold out of the structure trends.",
            help_behavior_hint="(default: none)",
        ),
    ] = (),
    poses: Annotated[
        int, tyro.conf.arg(metavar="N", help="Number of poses at which to compare M(q) and g(q).")
    ] = 300,
    seed: Annotated[int, tyro.conf.arg(metavar="N", help="Seed of the poses.")] = 0,
    workers: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Number of processes for --all.",
            help_behavior_hint="(default: one per processor)",
        ),
    ] = None,
    capabilities: Annotated[
        bool,
        tyro.conf.arg(
            help="Measure what the robot can do, with its maker's masses and with predicted ones, "
            "beside what is published (extra learn)."
        ),
    ] = False,
    policy: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="RUN|FILE.onnx",
            help="Policy of --capabilities.",
            help_behavior_hint="(default: the policy that ships for its legs)",
        ),
    ] = None,
    train: Annotated[
        Path | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Train two policies of the robot's own in this folder, one with each masses, and "
            "measure those with --capabilities; run it again to resume.",
            help_behavior_hint="(default: no training)",
        ),
    ] = None,
    json: JsonOutput = False,
) -> int:
    """Compare the masses and dynamics of a real robot with those that Draft predicts."""
    if (file is None) == (every is None):
        cause = "no robot is named" if file is None else "both FILE and --all are given"
        raise DraftError(cause, "run draft twin FILE, or draft twin --all DIR")
    from draft.twins.compare import check_poses, compare_twin

    check_poses(poses, seed)
    if workers is not None and workers < 1:
        raise DraftError(f"--workers {workers} is below 1", "such as 2")
    if every is not None:
        given = {"torque": torque, "speed": speed, "strict": strict, "knee-drive": knee_drive}
        _refuse("--all", spec=spec, population=population, without=without, root=root, **given)
        return _all(every, out, workers, poses, seed, json)
    _refuse("one FILE", workers=workers)
    assert file is not None
    options = Options(
        torque=parse(torque, "--torque", "N m"),
        speed=parse(speed, "--speed", "rad/s"),
        strict=strict,
        knee_drive=knee_drive,
        without=without,
        root=root,
    )
    if capabilities:
        _refuse("--capabilities", spec=spec, out=out, without=without)
        if policy is not None:
            _refuse("--policy", train=train)
        return _capabilities(file, policy, train, population, options, seed, json)
    _refuse("a comparison without --capabilities", policy=policy, train=train)
    with if_interrupted(NOTHING):
        found = compare_twin(
            file, spec, population=population, options=options, poses=poses, seed=seed
        )
    return _one(found, out, json)


def _capabilities(
    file: Path,
    policy: str | None,
    train: Path | None,
    population: str | None,
    options: Options,
    seed: int,
    json: bool,
) -> int:
    """Print what a robot can do in three columns."""
    from draft.cli.display.capabilities import print_capabilities, record
    from draft.validation.compare import real_robot

    with if_interrupted(NOTHING), bar("roll-outs") as progress:
        found = real_robot(
            file,
            policy=policy,
            train=train,
            population=population,
            options=options,
            seed=seed,
            report=lambda _, step, steps: progress(step, steps),
        )
    if json:
        print(json_.dumps(record(found), indent=1))
    else:
        print_capabilities(found)
    return 0


def _one(found: Comparison, out: Path | None, json: bool) -> int:
    """Print one comparison, and write its JSON and its figure."""
    from draft.plotting import make_folder
    from draft.twins.record import record

    if out is not None:
        make_folder(out)
    text = spelt(json_.dumps(record(found), indent=1))
    if json:
        print(text)
    else:
        print_one(found)
    if out is None:
        return 0
    files.write(out / f"{found.name}.json", text + "\n")
    paths = []
    if _can_draw():
        from draft.plotting import save
        from draft.twins import figure
        from draft.twins.look import side_by_side

        print("drawing both robots", file=sys.stderr)
        try:
            picture = side_by_side(found)
        except DraftError as error:
            print(f"no picture: {error.problems[0].cause}", file=sys.stderr)
            picture = None
        paths = save(out, {found.name: partial(figure.twin, found, picture)}, figure.DPI)
    if not json:
        print("\n".join(map(str, [out / f"{found.name}.json", *paths])))
    return 0


def _can_draw() -> bool:
    """Return whether figures can be drawn; say what is missing. The numbers need no figure."""
    try:
        need_installed("matplotlib", "figures")
    except DraftError as error:
        print(f"no figure: {error}", file=sys.stderr)
        return False
    return True


def _refuse(what: str, **given: object) -> None:
    for name, value in given.items():
        if value:
            cause = f"--{name} cannot be combined with {what}"
            raise DraftError(cause, f"omit --{name}")


def _all(
    source: Path, out: Path | None, workers: int | None, poses: int, seed: int, json: bool
) -> int:
    """Compare the robots of a folder or manifest; return 1 if one cannot be compared."""
    from draft.plotting import make_folder
    from draft.twins import every

    todo = every.tasks(source)
    if out is not None:
        make_folder(out)
    with if_interrupted(NOTHING):
        done = list(_watched(every.run(todo, workers, poses, seed), len(todo)))
    failed = sorted((f for f in done if isinstance(f, every.Failure)), key=lambda f: f.robot)
    rows = sorted(
        (row for row in done if isinstance(row, every.Row)),
        key=lambda row: (row.population, not row.fitted, row.robot),
    )
    if json:
        print(json_.dumps(every.record(rows, failed), indent=1))
    else:
        print_all(rows, failed)
    if out is not None and rows:
        files.write(out / "twins.csv", every.table_csv(rows))
        paths = []
        if any(not math.isnan(row.vendor_mass) for row in rows) and _can_draw():
            from draft.plotting import save
            from draft.twins import figure

            paths = save(out, {"twins": partial(figure.survey, rows)})
        if not json:
            print("\n".join(map(str, [out / "twins.csv", *paths])))
    return 1 if failed else 0


def _watched(
    results: Iterator[every.Row | every.Failure], count: int
) -> Iterator[every.Row | every.Failure]:
    """Yield results as they come, and show how many are done."""
    with bar("twins", at_once=True) as progress:
        progress(0, count)
        for done, one in enumerate(results, 1):
            yield one
            progress(done, count)

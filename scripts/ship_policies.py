"""Put policies into the package: `python -m scripts.ship_policies STUDY` or `... FAMILY_RUN`.

Of each design of a study the seed of the median top speed is shipped, with all its stages; of a
family the run that is given. Weights are stored in half precision, which halves the files and
changes actions by less than a hundredth of the exploration noise.
"""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from draft.files import write
from draft.learn.policy.policy import FAMILIES, FOLDER, STUDIED
from draft.learn.training.ppo.onnx import export
from draft.learn.training.run import is_run, open_run
from draft.learn.watching.play import Player
from draft.study.report.folder import read
from draft.study.report.records import Study
from draft.study.report.spread import by_seed


def main(folder: Path) -> None:
    """Export a family's run, or the chosen runs of a study's folder.

    A design of a study that is not through is left out.
    """
    if is_run(folder):
        plan = open_run(folder).plan
        skill = next(skill for skill, stage in STUDIED.items() if stage == plan.stage)
        if not plan.config.observations.linear_velocity:
            skill = "machine"
        _ship(folder, FAMILIES[skill])
        return
    study = read(folder)
    for design in study.titles:
        seed = median_seed(study, design)
        name = study.titles[design]
        runs = {skill: folder / "runs" / f"{name}-{STUDIED[skill]}-{seed}" for skill in STUDIED}
        lacking = [skill for skill, run in runs.items() if not _done(run)]
        if lacking:
            print(f"{name}: seed {seed} has not learnt to {', '.join(lacking)} yet")
            continue
        for skill, run in runs.items():
            _ship(run, FOLDER / f"{name}-{skill}.onnx")


def median_seed(study: Study, design: str) -> int | None:
    """Return the seed of the median top speed, nominal arm; None if it is unknown for all.

    It is the lower of the two middle seeds of an even number, and the first of seeds with the same
    speed.
    """
    known = by_seed(study, design, "nominal", "top_speed").known
    ranked = sorted(known, key=lambda seed: (known[seed], seed))
    if not ranked:
        return None
    middle = known[ranked[(len(ranked) - 1) // 2]]
    return next(seed for seed in ranked if known[seed] == middle)


def _ship(run: Path, file: Path) -> None:
    """Export the last policy of a run."""
    opened = open_run(run)
    with contextlib.closing(Player(opened, "cpu", ground="flat", engine="native")) as player:
        export(player, opened, file)
    write(file, halved(onnx.load(file)).SerializeToString())
    print(f"{file}: seed {opened.plan.seed}, {file.stat().st_size / 1e3:.0f} kB")


def _done(run: Path) -> bool:
    """Whether a run is trained to its end."""
    if not is_run(run):
        return False
    found = open_run(run)
    return found.done() >= found.plan.config.iterations(found.plan.stage)


def halved(model: onnx.ModelProto) -> onnx.ModelProto:
    """A network whose matrices are stored in half precision, and cast where they are used."""
    graph = model.graph
    casts = []
    for tensor in graph.initializer:
        values = numpy_helper.to_array(tensor)
        if values.ndim < 2 or min(values.shape) == 1:
            continue  # Vectors are small, and the normaliser's need their digits.
        name = tensor.name
        tensor.CopyFrom(numpy_helper.from_array(values.astype(np.float16), f"{name}.half"))
        casts.append(helper.make_node("Cast", [f"{name}.half"], [name], to=TensorProto.FLOAT))
    nodes = [*casts, *graph.node]
    del graph.node[:]
    graph.node.extend(nodes)
    onnx.checker.check_model(model)
    return model


if __name__ == "__main__":
    main(Path(sys.argv[1]))

"""Put the policies of a study into the package: `python -m scripts.ship_policies STUDY`.

Of each design the seed of the median top speed is shipped, with all its stages; of an even number
of seeds the slower of the middle two. Weights are stored in half precision, which halves the files
and changes actions by less than a hundredth of the exploration noise.
"""

from __future__ import annotations

import contextlib
import json
import sys
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from draft.files import write
from draft.learn.evaluation import FOLDER as EVALUATION
from draft.learn.evaluation import SUMMARY
from draft.learn.lab.onnx import export
from draft.learn.lab.play import Player
from draft.learn.policy import FOLDER, SKILLS
from draft.learn.run import open_run


def main(study: Path) -> None:
    """Export the chosen runs of a study's folder."""
    record = json.loads((study / "study.json").read_text(encoding="utf-8"))
    jobs = [job for job in record["jobs"].values() if job["kind"] == "train"]
    for design in dict.fromkeys(job["design"] for job in jobs):
        speeds = {
            job["seed"]: _top_speed(study / "runs" / f"{design}-velocity-{job['seed']}")
            for job in jobs
            if job["design"] == design and job["stage"] == "velocity"
        }
        seed = median_seed(speeds)
        print(f"{design}: seed {seed}; top speeds {speeds}")
        for skill, stage in SKILLS.items():
            run = open_run(study / "runs" / f"{design}-{stage}-{seed}")
            file = FOLDER / f"{design}-{skill}.onnx"
            with contextlib.closing(Player(run, "cpu", ground="flat", engine="native")) as player:
                export(player, run, file)
            write(file, halved(onnx.load(file)).SerializeToString())
            print(f"{file}: {file.stat().st_size / 1e3:.0f} kB")


def median_seed(speeds: dict[int, float]) -> int:
    """The seed of the median speed; the slower of the middle two."""
    return sorted(speeds, key=lambda seed: (speeds[seed], seed))[(len(speeds) - 1) // 2]


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


def _top_speed(run: Path) -> float:
    summary = json.loads((run / EVALUATION / "nominal-walking" / SUMMARY).read_text())
    return float(summary["scalars"]["top_speed"])


if __name__ == "__main__":
    main(Path(sys.argv[1]))

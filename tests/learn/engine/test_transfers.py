"""Transfers from the device within a step: how many are left, and that none is of Draft's terms.

On a GPU each of these calls waits for the device. They are counted on the CPU, where the same
calls are made: reading one number, looking for what is true, choosing by a mask.
"""

from __future__ import annotations

import ast
import sys
from collections import Counter
from pathlib import Path
from types import FrameType, FunctionType
from typing import Any

import pytest

pytest.importorskip("mjlab")
import mjlab
import torch
from torch.utils._python_dispatch import TorchDispatchMode

import draft
from tests.learn.task.states import place

SOURCES = {"draft": Path(draft.__file__).parent, "mjlab": Path(mjlab.__file__).parent}
READS = {"aten::_local_scalar_dense", "aten::item", "aten::nonzero", "aten::masked_select"}
MASKED = {"aten::index", "aten::index_put", "aten::index_put_", "aten::_index_put_impl_"}


class Transfers(TorchDispatchMode):
    """Counts transfers by the place that asks for one.

    Attributes:
        found: number by (package, file, function) nearest to the call.
        through: places of Draft that a transfer was made through.
    """

    def __init__(self) -> None:
        super().__init__()
        self.found: Counter[tuple[str, str, str]] = Counter()
        self.through: set[tuple[str, str, str]] = set()

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        name = func._schema.name
        if name in READS or (name in MASKED and _has_mask(args[1])):
            places = list(_places(sys._getframe(1)))
            self.found[places[0]] += 1
            self.through |= {place for place in places if place[0] == "draft"}
        return func(*args, **(kwargs or {}))


def _has_mask(indices: Any) -> bool:
    return any(index is not None and index.dtype == torch.bool for index in indices)


def _places(frame: FrameType | None) -> Any:
    """Functions of mjlab and of Draft that are being run, innermost first."""
    while frame is not None:
        path = Path(frame.f_code.co_filename)
        for package, root in SOURCES.items():
            if path.is_relative_to(root):
                yield package, path.relative_to(root).as_posix(), frame.f_code.co_name
        frame = frame.f_back


def counted(env: Any, fallen: bool) -> Transfers:
    """Transfers of one step, in which some worlds fall or none does."""
    place(env, (0.0, 0.0, 3.0))
    if fallen:
        at = torch.tensor([0.0, 0.0, 3.0]).repeat(env.num_envs, 1)
        quat = torch.tensor([1.0, 0.0, 0.0, 0.0]).repeat(env.num_envs, 1)
        quat[::3] = torch.tensor([0.0, 1.0, 0.0, 0.0])
        place(env, at, quat)
    env.command_manager.get_term("twist").time_left[:] = 5.0
    with Transfers() as transfers:
        env.step(torch.zeros(env.num_envs, 12))
    assert bool(env.reset_buf.any()) == fallen
    return transfers


# mjlab's own: which worlds start anew, and whose command is over.
STEP = {
    ("mjlab", "envs/manager_based_rl_env.py", "step"): 1,
    ("mjlab", "managers/command_manager.py", "compute"): 1,
}
# For the log, when a world starts anew: how often each ending came about, and the mean row that
# the curriculum tells.
ENDINGS = ("mjlab", "managers/termination_manager.py", "reset")
ROWS = ("mjlab", "managers/curriculum_manager.py", "reset")
LOG = {
    "flat": {ENDINGS: 3},
    "base": {ENDINGS: 4},
    "terrain": {ENDINGS: 4, ROWS: 1},
    "velocity": {ENDINGS: 3},
    "push": {ENDINGS: 3},
}


@pytest.mark.parametrize("stage", LOG)
@pytest.mark.parametrize("fallen", [False, True], ids=["walking", "falling"])
def test_transfers_of_a_step_are_mjlabs_own(
    request: pytest.FixtureRequest, stage: str, fallen: bool
) -> None:
    env = request.getfixturevalue(stage)
    transfers = counted(env, fallen)
    assert transfers.found == STEP | (LOG[stage] if fallen else {})
    assert transfers.through == set()


def test_the_count_sees_what_it_should() -> None:
    values = torch.arange(4)
    with Transfers() as transfers:
        for transfer in (
            lambda: bool(values.any()),
            lambda: values.sum().item(),
            lambda: values[values > 1],
            values.nonzero,
        ):
            _as_mjlab(transfer)
        _as_mjlab(lambda: torch.where(values > 1, values, 0))
    assert sum(transfers.found.values()) == 4


def _call(function: Any) -> None:
    function()


def _as_mjlab(call: Any) -> None:
    """Call something from a function that stands in a file of mjlab, as far as one can see."""
    file = str(SOURCES["mjlab"] / "somewhere.py")
    FunctionType(_call.__code__.replace(co_filename=file), {})(call)


TERMS = sorted(SOURCES["draft"].glob("learn/task/mdp/[!_]*.py"))


def test_there_are_terms_to_look_at() -> None:
    assert {"rewards.py", "events.py", "world_models.py"} < {path.name for path in TERMS}


@pytest.mark.parametrize("path", TERMS, ids=lambda path: path.name)
def test_no_term_copies_a_tensor_to_the_host(path: Path) -> None:
    """What a count on the CPU cannot see."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute):
            assert node.attr not in {"item", "tolist", "cpu", "numpy", "nonzero"}, node.lineno

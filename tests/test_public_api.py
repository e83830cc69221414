"""The public face: what `import draft` offers by name, documented by examples that run."""

from __future__ import annotations

import doctest
import inspect
import re
from collections.abc import Iterator
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pytest_regressions.file_regression import FileRegressionFixture

import draft

# Libraries of the optional extras that the example of a name needs.
NEEDS = {
    "evaluate": ("mjlab", "pyarrow"),
    "optimise": ("optuna", "scipy"),
    "page": ("mjswan",),
    "report": ("plotly",),
    "screen": ("pyarrow", "scipy"),
    "surface": ("mjlab", "pyarrow", "scipy"),
    "sweep": ("pyarrow", "scipy"),
    "train": ("mjlab",),
}
# Names without an example of their own: the errors say what was wrong, and Finding is only read.
WITHOUT = {name for name in draft.__all__ if name.endswith("Error")} | {"Location", "Problem"}


# Public functions and classes, and the functions of `draft.metrics`.
DOCUMENTED = [
    *sorted({*draft.__all__} - WITHOUT - {"extend", "metrics", "study"}),
    *("metrics.find", "metrics.of_design", "metrics.of_model"),
]


def test_dir_shows_the_public_names_and_each_is_there() -> None:
    assert dir(draft) == sorted(draft.__all__)
    for name in draft.__all__:
        assert getattr(draft, name) is not None
    with pytest.raises(AttributeError, match="module 'draft' has no attribute 'lode'"):
        draft.lode  # noqa: B018


def test_every_lazy_name_is_the_one_that_type_checkers_see() -> None:
    text = Path(draft.__file__).read_text(encoding="utf-8")
    seen = {
        name.strip(): module
        for module, names in re.findall(r"^    from (draft[\w.]*) import (.+)$", text, re.M)
        for name in names.split(",")
    }
    assert seen == {**draft._MODULES, "extend": "draft", "metrics": "draft", "study": "draft"}


def test_names_and_signatures(file_regression: FileRegressionFixture) -> None:
    lines = []
    for name in draft.__all__:
        found = getattr(draft, name)
        if inspect.ismodule(found):
            lines.append(f"package {name}: {', '.join(sorted(found.__all__))}")
        elif inspect.isclass(found):
            lines.append(f"class {name}")
            lines += [f"    {line}" for line in _members(found)]
        else:
            lines.append(f"{name}{_signature(found)}")
    file_regression.check("\n".join(lines) + "\n")


def _members(kind: type) -> Iterator[str]:
    """Public attributes and methods of a class of ours, with the signatures of methods."""
    if issubclass(kind, Exception):
        return
    for name in sorted({*kind.__dict__, *getattr(kind, "__annotations__", {})}):
        if name.startswith("_"):
            continue
        found = kind.__dict__.get(name)
        yield f"{name}{_signature(found)}" if inspect.isfunction(found) else name


def _signature(function: Any) -> str:
    """Signature as in the source, without quotes around the types."""
    return re.sub(r"(: |-> )'([^']*)'", r"\1\2", str(inspect.signature(function)))


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow) if "mjlab" in NEEDS.get(name, ()) else name
        for name in DOCUMENTED
    ],
)
def test_the_example_of_every_public_name_runs(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in NEEDS.get(name, ()):
        pytest.importorskip(module)
    monkeypatch.chdir(tmp_path)
    examples = _examples(attrgetter(name)(draft))
    assert examples, f"{name} has no example"
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    for example in examples:
        runner.run(example)
    assert runner.failures == 0


def _examples(found: Any) -> list[doctest.DocTest]:
    """Examples in the docstring of a function, or of a class and its methods."""
    finder = doctest.DocTestFinder(exclude_empty=True)
    module = inspect.getmodule(found)
    tests = finder.find(found, module=module, globs={"draft": draft, "np": np})
    return [test for test in tests if test.examples]


@pytest.mark.parametrize("name", DOCUMENTED)
def test_every_public_function_documents_its_arguments_and_errors(name: str) -> None:
    found = attrgetter(name)(draft)
    if inspect.isclass(found):
        return
    text = inspect.getdoc(found) or ""
    parameters = inspect.signature(found).parameters
    if parameters:
        assert "\nArgs:\n" in text
        assert "\nRaises:\n" in text
    for parameter in parameters:
        assert re.search(rf"^    {parameter}: \S", text, re.M), parameter


def test_a_representation_is_one_short_line() -> None:
    spec = draft.load("quadruped")
    design = spec.resolve("cheetah")
    refused = spec.resolve({"actuators.leg.peak_torque": 5000})
    many = spec.resolve({"thigh_length": np.linspace(0.2, 0.7, 1000)})
    shown = {
        spec: "Spec('quadruped', 14 parameters, 1 actuator class, 12 joints, 3 named designs)",
        design.build(): "Model('quadruped:cheetah', 33.6 kg, nq=19, nv=18)",
    }
    for found, text in shown.items():
        assert repr(found) == text
    assert repr(design) == "Design('quadruped:cheetah', 33.6 kg, 12 joints, accepted)"
    assert re.fullmatch(
        r"Design\('quadruped', \S+ kg, 12 joints, refused: torque, .*\)", repr(refused)
    )
    assert re.fullmatch(
        r"Design\('quadruped', 1000 designs, \S+\.\.\S+ kg, 12 joints, \d+ accepted\)", repr(many)
    )
    assert repr(refused.findings[0]).startswith("Finding(error 'torque:leg': peak torque ")
    assert re.match(r"Finding\(\w+ '\S+' of \d+ of 1000 designs: ", repr(many.findings[0]))
    for one in (*many.findings, *refused.findings, *design.actuators.values()):
        assert "\n" not in repr(one)
        assert len(repr(one)) < 300

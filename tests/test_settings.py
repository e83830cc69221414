"""Settings as a record: its fields are checked, keyword arguments, and options of a command."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
import pytest
import tyro
from pydantic import Field

from draft.cli.completion import arguments
from draft.cli.settings_options import with_options
from draft.cli.values import registry
from draft.errors import DraftError
from draft.settings import Settings, Shown, by_keyword, takes


class Options(Settings):
    """Settings of a measurement."""

    replicas: Annotated[int, Field(ge=1, le=1000), Shown("N")] = 256
    """Roll-outs of each level."""
    minutes: Annotated[float | None, Field(gt=0), Shown("M", "no limit")] = None
    """Time limit [min]."""
    errors: Annotated[Literal["twins", "paper"] | None, Shown("{twins,paper}", "none")] = None
    """Source of the errors."""
    levels: Annotated[
        int | Sequence[float] | None, Shown("N|VALUES", "all", expects="a number, or levels")
    ] = None
    """Number of levels, or the levels."""
    quiet: bool = False
    """Print nothing."""


@takes(Options)
def measure(run: str, options: Options) -> tuple[str, Options]:
    """Measure a run.

    Args:
        run: the run.
        options: fields of `Options`, by keyword.
    """
    return run, options


def test_a_function_takes_the_fields_by_keyword_and_documents_them() -> None:
    found = measure("a", replicas=3, levels=[1, 2.5])
    assert found == ("a", Options(replicas=3, levels=(1.0, 2.5)))
    given: Any = {"replicas": np.int64(3), "levels": np.array([1.0, 2.5]), "minutes": 2}
    assert measure("a", **given)[1] == Options(replicas=3, levels=(1.0, 2.5), minutes=2.0)
    signature = inspect.signature(measure)
    assert list(signature.parameters) == ["run", *Options.model_fields]
    assert signature.parameters["replicas"].default == 256
    text = inspect.getdoc(measure) or ""
    assert "\n    run: the run.\n    replicas: roll-outs of each level.\n    minutes: time" in text
    wrong: Any = {"replica": 3}
    with pytest.raises(TypeError, match="unexpected keyword argument 'replica'"):
        measure("a", **wrong)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"replicas": 0}, "`replicas` 0 is not a whole number from 1 to 1000\n  omit it for 256"),
        ({"replicas": True}, "`replicas` True is not a whole number from 1 to 1000"),
        ({"replicas": 2.5}, "`replicas` 2.5 is not a whole number"),
        (
            {"minutes": float("nan")},
            "`minutes` nan is not a number above 0\n  omit it for no limit",
        ),
        ({"errors": "papr"}, "`errors` 'papr' is not known\n  did you mean 'paper'? choose from"),
        ({"levels": "x"}, "`levels` 'x' is not a number, or levels\n  omit it for all"),
        ({"quiet": 1}, "`quiet` 1 is not true or false"),
        ({"replica": 3}, "there is no setting 'replica'\n  did you mean 'replicas'?"),
        ({"replicas": 0, "minutes": 0}, "`minutes` 0 is not a number above 0"),
    ],
)
def test_an_invalid_value_is_refused_with_what_is_expected(
    values: dict[str, Any], message: str
) -> None:
    with pytest.raises(DraftError) as raised:
        Options.of(values)
    assert message in str(raised.value)


def test_settings_travel_as_json() -> None:
    options = Options(replicas=3, levels=(1.0, 2.5), errors="paper")
    assert Options.of(options.model_dump(mode="json")) == options


def commas(text: str) -> object:
    return [float(part) for part in text.split(",")]


@with_options(Options, without=("quiet",), read={"levels": commas})
def command(
    runs: tyro.conf.Positional[tuple[str, ...]],
    /,
    *,
    options: Options,
    again: Annotated[bool, tyro.conf.arg(help="Repeat it.")] = False,
) -> int:
    """Measure runs."""
    called.append((runs, options, again))
    return 0


called: list[tuple[tuple[str, ...], Options, bool]] = []


def call(*words: str) -> int:
    config = (tyro.conf.FlagCreatePairsOff,)
    return tyro.cli(command, prog="measure", args=words, config=config, registry=registry)


def test_a_command_has_an_option_for_each_field(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("a", "b", "--replicas", "3", "--levels", "1,2.5", "--again") == 0
    assert called.pop() == (("a", "b"), Options(replicas=3, levels=(1.0, 2.5)), True)
    with pytest.raises(SystemExit):
        call("--help")
    told = " ".join(capsys.readouterr().out.split())
    assert "--replicas N Roll-outs of each level. (default: 256)" in told
    assert "--minutes M Time limit [min]. (default: no limit)" in told
    assert "--quiet" not in told
    names = ["", "--replicas", "--minutes", "--errors", "--levels", "--again"]
    assert list(arguments(command)) == names
    with pytest.raises(DraftError, match="`minutes` -1 is not a number above 0"):
        call("a", "--minutes", "-1")


@by_keyword(Options)
def measure_into(run: str, out: str = "out", *, options: Options) -> tuple[str, str, Options]:
    """Measure a run.

    Args:
        run: the run.
        out: folder of the result.
        options: fields of `Options`, by keyword.
    """
    return run, out, options


def test_a_function_may_have_other_arguments_beside_the_fields() -> None:
    assert measure_into("a", quiet=True) == ("a", "out", Options(quiet=True))
    assert measure_into("a", "b", replicas=3) == ("a", "b", Options(replicas=3))
    text = inspect.getdoc(measure_into) or ""
    assert "\n    minutes: time limit [min]; by default no limit.\n" in text

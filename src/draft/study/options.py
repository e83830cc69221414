"""Options of a call that runs a study, for Python and the command."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from draft.learn.engine.machine import EngineName
from draft.settings import Settings, Shown


class Placement(Settings):
    """Devices of the jobs of a study, and the number of jobs at once."""

    device: Annotated[str, Shown("DEVICE")] = "auto"
    """Where to run: auto (all GPUs, or the CPU), cpu, cuda:1, or numbers of GPUs such as 0,1."""
    workers: Annotated[
        int | None,
        Field(ge=1, le=1024),
        Shown("N", "one per GPU; on a CPU one that uses all cores"),
    ] = None
    """Number of jobs at once."""
    engine: EngineName = "auto"
    replicas: Annotated[
        int | None,
        Field(ge=1, le=10**5),
        Shown("N", "one per physical core, shared by the jobs at once"),
    ] = None
    """Number of processes of each training on a CPU."""
    ray: bool = False
    """Run on a Ray cluster that shares the folder, not on this machine."""
    address: Annotated[str | None, Shown("HOST:PORT", "this machine's")] = None
    """Address of the Ray cluster."""

    @model_validator(mode="after")
    def _check_address(self) -> Self:
        if self.address is not None and not self.ray:
            words = {
                "cause": "`address` is for a Ray cluster",
                "remedy": "add `ray`, or omit `address`",
            }
            raise PydanticCustomError("broken_rule", "", words)
        return self


class RunOptions(Placement):
    """Options of one call."""

    minutes: Annotated[float | None, Field(gt=0, le=10**6), Shown("M", "no limit")] = None
    """Time limit, from the start of the call [min]; repeat it to resume."""

"""Ways to packages that are imported on first use: public names, and verbs of the data flow."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])


def on_first_use(package: str, homes: Mapping[str, str]) -> Callable[[str], object]:
    """Return the `__getattr__` of a package, whose public names are imported on first use.

    Args:
        package: its name.
        homes: by name, the module that it is imported from, with ":NAME" where it is another name
            there; a name with "" is a module of the package.
    """

    def get(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        import importlib

        if not homes[name]:
            return importlib.import_module(f"{package}.{name}")
        module, _, there = homes[name].partition(":")
        return getattr(importlib.import_module(module), there or name)

    return get


def verb(method: F) -> F:
    """Mark a method that hands its object on to the next package: `Spec.resolve`, `Design.build`.

    Only such a method may import a package that comes after its own.
    """
    return method

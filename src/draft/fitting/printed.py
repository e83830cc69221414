"""Figures of a publication, beside Draft's, each with the label of its source.

`paper`: the text of the paper prints it; `released data`: it is from the data and code released
with the paper; `ours`: neither gives it.
"""

from __future__ import annotations

from dataclasses import dataclass

PAPER, RELEASED, OURS = "paper", "released data", "ours"
SOURCES = (PAPER, RELEASED, OURS)


@dataclass(frozen=True, slots=True)
class Figure:
    """One printed figure and Draft's; they agree if Draft's rounds to the printed digits.

    Attributes:
        quantity: quantity of actuators or class of parts that the law predicts.
        name: name of the figure, such as "R2".
        printed: figure or range as published; None where none is.
        value: Draft's figure for the published form; None where it is not fitted.
        draft: figure for Draft's own form, where it has the same meaning.
        note: explanation of a difference or a choice.
        population: "humanoid" or "quadruped" for a law of structure.
        released: whether the published figure is from the released data, not from the text.
    """

    quantity: str
    name: str
    printed: str | None
    value: float | None
    draft: float | None = None
    note: str = ""
    population: str = ""
    released: bool = False

    @property
    def source(self) -> str:
        """Label of the source of the published figure; `ours` where none is published."""
        if self.printed is None:
            return OURS
        return RELEASED if self.released else PAPER

    @property
    def digits(self) -> int:
        """Number of decimals of the printed figure; three where none is printed."""
        if self.printed is None:
            return 3
        return len(self.bounds[1].partition(".")[2])

    @property
    def bounds(self) -> tuple[str, str]:
        """Lowest and highest printed figure; they differ only for a range."""
        printed = self.printed or ""
        low, dash, high = printed.partition("-")
        return (low, high) if low and dash else (printed, printed)

    @property
    def ours(self) -> str:
        """Draft's figure to the printed digits; "" where there is none."""
        return "" if self.value is None else f"{self.value:.{self.digits}f}"

    @property
    def same(self) -> bool:
        """Whether Draft's figure equals the printed one, or lies in the printed range."""
        if self.printed is None or self.ours == self.printed:
            return True
        low, high = self.bounds
        return self.value is not None and float(low) <= float(self.ours) <= float(high)

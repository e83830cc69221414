"""Figures that a publication prints, beside Draft's."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Figure:
    """One printed figure and Draft's; they agree if Draft's rounds to the printed digits.

    Attributes:
        quantity: quantity of actuators or class of parts that the law predicts.
        name: name of the figure, such as "R2".
        printed: figure or range as printed; None where none is.
        value: Draft's figure for the published form; None where it is not fitted.
        draft: figure for Draft's own form, where it has the same meaning.
        note: explanation of a difference or a choice.
        population: "humanoid" or "quadruped" for a law of structure.
    """

    quantity: str
    name: str
    printed: str | None
    value: float | None
    draft: float | None = None
    note: str = ""
    population: str = ""

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

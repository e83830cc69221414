"""A figure that a publication prints, beside ours."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Figure:
    """One printed figure and ours, which is the same where it rounds to the printed digits.

    Attributes:
        quantity: which law: a quantity of actuators or a class of parts.
        name: what of it.
        printed: as printed, perhaps a range; None where it is not.
        value: ours, by the published form; None where it is not fitted.
        draft: that of Draft's own form, where it has the same meaning.
        note: what explains a difference or a choice.
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
        """Decimals of the printed figure; three where it is not printed."""
        if self.printed is None:
            return 3
        return len(self.bounds[1].partition(".")[2])

    @property
    def bounds(self) -> tuple[str, str]:
        """Lowest and highest printed figure; the same but for a range."""
        printed = self.printed or ""
        low, dash, high = printed.partition("-")
        return (low, high) if low and dash else (printed, printed)

    @property
    def ours(self) -> str:
        """Our figure to the printed digits; "" where there is none."""
        return "" if self.value is None else f"{self.value:.{self.digits}f}"

    @property
    def same(self) -> bool:
        """Whether ours is the printed one, or lies in the printed range."""
        if self.printed is None or self.ours == self.printed:
            return True
        low, high = self.bounds
        return self.value is not None and float(low) <= float(self.ours) <= float(high)

"""Orders of designs: the bootstrap against what is known in closed form."""

from __future__ import annotations

import itertools
import math
import statistics
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("pyarrow")

from draft.study.report.folder import read
from draft.study.report.ordering import Ordering, by_chance, of_study, order
from draft.study.report.tables import certainty
from tests.learn import synthetic

numbers = st.lists(st.integers(-50, 50).map(float), min_size=1, max_size=4)


def exact(a: list[float], b: list[float]) -> float:
    """Probability that the median of a resample of a is above that of b, over all resamples."""
    resamples = [[statistics.median(draw) for draw in itertools.product(v, repeat=len(v))]
                 for v in (a, b)]  # fmt: skip
    pairs = itertools.product(*resamples)
    return statistics.fmean(1.0 if x > y else 0.5 if x == y else 0.0 for x, y in pairs)


def made(values: dict[str, list[float]]) -> Ordering:
    found = order(values)
    assert found is not None
    assert found == order(values)  # The same values give the same probabilities.
    return found


def test_designs_whose_ranges_lie_apart_are_always_in_that_order() -> None:
    found = made({"low": [1.0, 2.0, 3.0], "high": [3.5, 4.0, 9.0]})
    assert (found.designs, found.probability, found.other) == (("high", "low"), 1.0, None)
    (pair,) = found.pairs
    assert (pair.probability, pair.apart) == (1.0, True)


@pytest.mark.parametrize(("names", "share"), [("ab", 1 / 2), ("abc", 1 / 6)])
def test_designs_that_are_equal_are_in_any_order_as_often(names: str, share: float) -> None:
    found = made({name: [1.0, 2.0, 3.0] for name in names})
    assert found.probability == pytest.approx(share, abs=0.015)
    assert found.other is not None
    assert found.other[1] == pytest.approx(share, abs=0.015)
    assert found.pairs[0].probability == pytest.approx(0.5, abs=0.015)
    assert not found.pairs[0].apart


@settings(max_examples=25, deadline=None)
@given(numbers, numbers)
def test_a_pair_has_the_probability_of_all_resamples(a: list[float], b: list[float]) -> None:
    found = made({"a": a, "b": b})
    (pair,) = found.pairs
    expected = exact(a, b) if pair.better == "a" else exact(b, a)
    # Five standard deviations of a share of 20 000 draws.
    assert pair.probability == pytest.approx(expected, abs=5 * 0.5 / math.sqrt(20_000))
    assert found.probability == pytest.approx(expected, abs=10 * 0.5 / math.sqrt(20_000))


def test_a_seed_without_the_skill_is_below_all_others() -> None:
    found = made({"none": [-math.inf] * 3, "some": [-math.inf, 0.1, 0.2]})
    assert found.designs == ("some", "none")
    # Two of three draws or more hit the seed without it in 7 of 27 resamples: then it is a tie.
    assert found.pairs[0].probability == pytest.approx(1 - 7 / 27 / 2, abs=0.015)
    assert order({"a": [1.0], "b": []}) is None


@pytest.mark.parametrize(("first", "second"), [(1, 1), (2, 3), (3, 3)])
def test_chance_is_the_share_of_permutations(first: int, second: int) -> None:
    ranks = range(first + second)
    draws = list(itertools.permutations(ranks))
    apart = sum(min(draw[:first]) > max(draw[first:]) for draw in draws)
    assert by_chance(first, second) == pytest.approx(apart / len(draws))


def test_few_seeds_are_said_to_give_little_certainty() -> None:
    said = certainty([3, 3, 3])
    assert "3 seeds give little certainty" in said
    assert "in 5 % of all studies" in said
    assert "little certainty" not in certainty([10, 10])


def test_a_studys_designs_are_ordered_by_their_medians(source: Path) -> None:
    study = read(source)
    found = of_study(study, "nominal", "step")
    assert found is not None
    assert [name.partition(":")[2] for name in found.designs] == ["giraffe", "bear", "cheetah"]
    assert set(found.seeds.values()) == {3}


def test_the_policy_that_ships_is_that_of_the_median_seed(source: Path, tmp_path: Path) -> None:
    pytest.importorskip("onnx")
    from scripts.ship_policies import median_seed

    study = read(source)
    for design in synthetic.DESIGNS:
        speeds = {seed: synthetic.able(design, seed, "nominal")[0] for seed in (0, 1, 2)}
        chosen = median_seed(study, f"quadruped:{design}")
        assert chosen is not None
        assert speeds[chosen] == statistics.median(speeds.values())
    even = synthetic.study(tmp_path, ("cheetah",), (0, 1), ("nominal",), ("velocity",))
    speeds = [synthetic.able("cheetah", seed, "nominal")[0] for seed in (0, 1)]
    assert median_seed(read(even), "quadruped:cheetah") == speeds.index(min(speeds))

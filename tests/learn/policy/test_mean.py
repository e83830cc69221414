"""The mean of two policies of all legs, whose statistics of observations differ."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnx")

from draft.errors import DraftError
from draft.learn.policy.onnx_file import read
from draft.learn.policy.onnx_write import chain
from draft.learn.policy.policy import ANY, FAMILY
from draft.learn.policy.reduced import open_legs_policy
from scripts.mean_of_policies import main


@pytest.mark.parametrize("share", [0.0, 1.0, 0.5])
def test_shares_of_nothing_and_of_all_are_the_policies_themselves(
    share: float, tmp_path: Path
) -> None:
    mean, divisor, layers = read(ANY).layers()
    noise = np.random.default_rng(0).normal(size=len(mean))
    seen = (mean + divisor * noise).astype(np.float32)
    after, out = tmp_path / "after.onnx", tmp_path / "out.onnx"
    *others, (weight, bias) = layers
    changed = [*others, (weight, bias + 1.0)]
    varied = divisor > 0.02
    other = mean + 0.3 * varied, divisor * np.where(varied, 2.0, 1.0)
    after.write_bytes(chain(*other, changed, read(ANY).metadata))
    main(ANY, after, out, share)
    first, last, found = (open_legs_policy(file).network(seen) for file in (ANY, after, out))
    if share == 0.0:
        np.testing.assert_allclose(found, first, atol=1e-4)
    elif share == 1.0:
        np.testing.assert_allclose(found, last, atol=1e-4)
    else:
        assert abs(found - first).max() > 0.01 < abs(found - last).max()


def test_policies_of_one_kind_of_robot_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DraftError, match="no policy of all legs"):
        main(FAMILY, ANY, tmp_path / "out.onnx", 0.5)

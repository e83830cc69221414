"""Networks in ONNX files, held against ONNX's own reference evaluator."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from draft.errors import DraftError
from draft.learn.policy.onnx_file import read
from draft.learn.policy.policy import open_policy

onnx = pytest.importorskip("onnx")
from onnx import TensorProto, helper, numpy_helper  # noqa: E402
from onnx.reference import ReferenceEvaluator  # noqa: E402

RANDOM = np.random.default_rng(0)


def weights(*shape: int, half: bool = False) -> Any:
    return RANDOM.normal(size=shape).astype(np.float16 if half else np.float32)


def model(half: bool = False, **gemm: Any) -> Any:
    """Normalised observation of five, a hidden layer of four, two actions."""
    values = {
        "mean": weights(1, 5),
        "std": np.abs(weights(1, 5)) + 0.1,
        "w0.half" if half else "w0": weights(4, 5, half=half),
        "b0": weights(4),
        "w1": weights(2, 4),
        "b1": weights(2),
    }
    attributes = {"alpha": 1.0, "beta": 1.0, "transB": 1} | gemm
    nodes = [helper.make_node("Cast", ["w0.half"], ["w0"], to=TensorProto.FLOAT)] * half
    nodes += [
        helper.make_node("Sub", ["obs", "mean"], ["a"]),
        helper.make_node("Div", ["a", "std"], ["b"]),
        helper.make_node("Gemm", ["b", "w0", "b0"], ["c"], **attributes),
        helper.make_node("Elu", ["c"], ["d"], alpha=1.0),
        helper.make_node("Gemm", ["d", "w1", "b1"], ["actions"], **attributes),
    ]
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [1, 5])],
        [helper.make_tensor_value_info("actions", TensorProto.FLOAT, [1, 2])],
        [numpy_helper.from_array(value, name) for name, value in values.items()],
    )
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)])
    helper.set_model_props(made, {"stage": "base", "design": "quadruped:cheetah"})
    return made


def saved(folder: Path, made: Any) -> Path:
    path = folder / "policy.onnx"
    path.write_bytes(made.SerializeToString())
    return path


@pytest.mark.parametrize("half", [False, True])
def test_a_network_gives_what_onnx_itself_gives(tmp_path: Path, half: bool) -> None:
    made = model(half)
    network = read(saved(tmp_path, made))
    seen = weights(1, 5)
    (expected,) = map(np.asarray, ReferenceEvaluator(made).run(None, {"obs": seen}))
    np.testing.assert_allclose(network(seen), expected, atol=1e-6)
    assert network.size == 5
    assert network.metadata["design"] == "quadruped:cheetah"
    # Its layers are those that it is evaluated with.
    mean, divisor, layers = network.layers()
    assert network.units() == (4,)
    hidden = (seen - mean) / divisor
    for i, (weight, bias) in enumerate(layers):
        hidden = hidden @ weight.T + bias
        if i < len(layers) - 1:
            hidden = np.where(hidden > 0, hidden, np.exp(hidden) - 1)
    np.testing.assert_allclose(hidden, network(seen), atol=1e-5)


def test_observations_come_one_by_one_or_many_at_once(tmp_path: Path) -> None:
    network = read(saved(tmp_path, model()))
    seen = weights(3, 2, 5)
    found = network(seen)
    assert found.shape == (3, 2, 2)
    np.testing.assert_allclose(network(seen[1, 1]), found[1, 1], atol=1e-6)


def relu(made: Any) -> Any:
    made.graph.node[3].op_type = "Relu"
    return made


def without_bias(made: Any) -> Any:
    del made.graph.node[2].input[2]
    return made


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (model(transB=0), "transB"),
        (model(alpha=2.0), "'alpha': 2.0"),
        (relu(model()), "it has a node 'Relu'; known: Sub, Div"),
        (without_bias(model()), "is not a policy that Draft can read"),
        (None, "cannot read"),
    ],
    ids=["attribute", "other number", "unknown node", "few inputs", "missing"],
)
def test_networks_of_others_are_refused(tmp_path: Path, made: Any, words: str) -> None:
    path = tmp_path / "none.onnx" if made is None else saved(tmp_path, made)
    with pytest.raises(DraftError, match=words):
        read(path)


@given(cut=st.floats(0, 0.999))
@settings(max_examples=40)
def test_a_truncated_file_is_reported(tmp_path: Path, cut: float) -> None:
    path = saved(tmp_path, model())
    data = path.read_bytes()
    path.write_bytes(data[: int(cut * len(data))])
    with pytest.raises(DraftError):
        open_policy(path)


@given(data=st.binary(max_size=300))
@example(data=b"8\x00")  # A number where a graph should be.
@settings(max_examples=80)
def test_any_bytes_are_refused_in_words(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "any.onnx"
    path.write_bytes(data)
    with pytest.raises(DraftError, match="is not a policy that Draft can read"):
        read(path)

"""Feed-forward networks in ONNX files, read and evaluated with NumPy only.

It reads the files that `draft play` writes: a chain of Sub, Div, Gemm, Elu and Cast with
weights of single or half precision. The file is decoded by the wire format of Protocol Buffers
(https://protobuf.dev/programming-guides/encoding) and the field numbers of onnx.proto.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from draft.errors import DraftError

Array = NDArray[np.float32]
# Field numbers of onnx.proto.
_GRAPH, _METADATA = 7, 14
_NODES, _INITIALIZERS, _INPUTS, _OUTPUTS = 1, 5, 11, 12
_DIMS, _TYPE, _NAME, _RAW = 1, 2, 8, 9
_FLOAT, _HALF = 1, 10  # Values of TensorProto.DataType.
_DTYPES = {_FLOAT: np.dtype("<f4"), _HALF: np.dtype("<f2")}


@dataclass(frozen=True)
class Network:
    """A network and the metadata of its file.

    Attributes:
        size: length of the input.
        metadata: metadata as text by key.
    """

    size: int
    metadata: Mapping[str, str]
    _steps: tuple[tuple[Callable[..., Array], tuple[str, ...], str], ...]
    _weights: Mapping[str, Array]
    _input: str
    _output: str

    def __call__(self, values: Array) -> Array:
        """Evaluate the network.

        Args:
            values: inputs, shape (..., size).

        Returns:
            Outputs, shape (..., outputs).
        """
        known = {**self._weights, self._input: values.reshape(-1, self.size)}
        for function, names, output in self._steps:
            known[output] = function(*(known[name] for name in names))
        return known[self._output].reshape(*values.shape[:-1], -1)

    def layers(self) -> tuple[Array, Array, list[tuple[Array, Array]]]:
        """Return the parameters of a network that normalises its input, and then has layers.

        Returns:
            Mean and divisor of the input, shape (size,), and of each layer the weights, shape
            (outputs, inputs), and the bias, shape (outputs,).

        Raises:
            DraftError: it has another form.
        """
        known, found = dict(self._weights), []
        for function, names, output in self._steps:
            if function is _cast:
                known[output] = _cast(known[names[0]])
            elif function is not _elu:
                found.append([known[name] for name in names[1:]])
        try:
            (mean,), (divisor,), *more = found
            layers = [(weight, bias) for weight, bias in more]
        except ValueError:
            cause = "the network has another form than a policy of Draft"
            remedy = "use a file that 'draft play' wrote"
            raise DraftError(cause, remedy) from None
        return mean.reshape(-1), divisor.reshape(-1), layers

    def units(self) -> tuple[int, ...]:
        """Return the number of units of each hidden layer."""
        return tuple(len(bias) for _, bias in self.layers()[2][:-1])


def of_layers(
    mean: ArrayLike,
    divisor: ArrayLike,
    layers: Sequence[tuple[ArrayLike, ArrayLike]],
    metadata: Mapping[str, str],
) -> Network:
    """Make a network from what `Network.layers` returns.

    Args:
        mean: mean of the input, shape (size,).
        divisor: divisor of the input, shape (size,).
        layers: weights, shape (outputs, inputs), and bias, shape (outputs,), of each layer.
        metadata: metadata as text by key.
    """
    weights: dict[str, ArrayLike] = {"mean": mean, "divisor": divisor}
    steps: list[tuple[Callable[..., Array], tuple[str, ...], str]] = [
        (np.subtract, ("input", "mean"), "centred"),
        (np.divide, ("centred", "divisor"), "0"),
    ]
    for i, (weight, bias) in enumerate(layers):
        weights |= {f"weight {i}": weight, f"bias {i}": bias}
        steps.append((_gemm, (str(i), f"weight {i}", f"bias {i}"), f"sum {i}"))
        if i + 1 < len(layers):
            steps.append((_elu, (f"sum {i}",), str(i + 1)))
    single = {name: np.asarray(values, np.float32) for name, values in weights.items()}
    return Network(len(single["mean"]), metadata, tuple(steps), single, "input", steps[-1][2])


def read(path: Path) -> Network:
    """Read a network.

    Args:
        path: ONNX file.

    Raises:
        DraftError: the file cannot be read, or holds another kind of network.
    """
    try:
        return _network(path.read_bytes())
    except OSError as error:
        cause, remedy = f"cannot read {path}: {error.strerror}", "check its name"
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, struct.error) as error:
        cause = f"{path} is not a policy that Draft can read: {error}"
        remedy = "use a file that 'draft play' wrote"
    raise DraftError(cause, remedy) from None


def _network(data: bytes) -> Network:
    model = _grouped(data)
    graph = _grouped(_one(model, _GRAPH, "graph"))
    weights = dict(map(_tensor, graph.get(_INITIALIZERS, [])))
    inputs = [_text(_grouped(one)[1][0]) for one in graph.get(_INPUTS, [])]
    outputs = [_text(_grouped(one)[1][0]) for one in graph.get(_OUTPUTS, [])]
    inputs = [name for name in inputs if name not in weights]
    if len(inputs) != 1 or len(outputs) != 1:
        raise ValueError("it has several inputs or outputs")
    steps = tuple(map(_step, graph.get(_NODES, [])))
    first = next((names for _, names, _ in steps if inputs[0] in names), ())
    sizes = [weights[name].shape[-1] for name in first if name in weights]
    if not sizes:
        raise ValueError("its input is not normalised")
    metadata = {
        _text(pair[1][0]): _text(pair.get(2, [b""])[0])
        for pair in map(_grouped, model.get(_METADATA, []))
    }
    network = Network(sizes[0], metadata, steps, weights, inputs[0], outputs[0])
    network(np.zeros(sizes[0], np.float32))  # Raises if shapes or names do not fit.
    return network


def _step(data: bytes) -> tuple[Callable[..., Array], tuple[str, ...], str]:
    """Function, input names and output name of a node."""
    node = _grouped(data)
    kind = _text(_one(node, 4, "type of a node"))
    if kind not in _OPERATIONS:
        raise ValueError(f"it has a node '{kind}'; known: {', '.join(_OPERATIONS)}")
    attributes = {}
    for one in map(_grouped, node.get(5, [])):
        name = _text(one[1][0])
        attributes[name] = one[3][0] if 3 in one else struct.unpack("<f", one[2][0])[0]
    function, expected = _OPERATIONS[kind]
    if attributes != expected:
        raise ValueError(f"node '{kind}' has attributes {attributes}, not {expected}")
    return function, tuple(map(_text, node.get(1, []))), _text(_one(node, 2, "output of a node"))


def _gemm(values: Array, weight: Array, bias: Array) -> Array:
    return values @ weight.T + bias


def _elu(values: Array) -> Array:
    return np.where(values > 0, values, np.expm1(np.minimum(values, 0)))


def _cast(values: np.ndarray) -> Array:
    return values.astype(np.float32)


# Functions by type of node, and the attributes that they require.
_OPERATIONS: Mapping[str, tuple[Callable[..., Array], Mapping[str, float]]] = {
    "Sub": (np.subtract, {}),
    "Div": (np.divide, {}),
    "Gemm": (_gemm, {"alpha": 1.0, "beta": 1.0, "transB": 1}),
    "Elu": (_elu, {"alpha": 1.0}),
    "Cast": (_cast, {"to": _FLOAT}),
}


def _tensor(data: bytes) -> tuple[str, np.ndarray]:
    """Name and values of an initialiser."""
    fields = _grouped(data)
    name, kind = _text(_one(fields, _NAME, "name of a tensor")), _one(fields, _TYPE, "type")
    if kind not in _DTYPES:
        raise ValueError(f"tensor '{name}' is of type {kind}")
    dims = []
    for one in fields.get(_DIMS, []):
        dims += [one] if isinstance(one, int) else list(_varints(one))
    values = np.frombuffer(_one(fields, _RAW, f"values of '{name}'"), _DTYPES[kind])
    return name, values.reshape(dims)


def _one(fields: Mapping[int, list[Any]], number: int, what: str) -> Any:
    values = fields.get(number, [])
    if len(values) != 1:
        raise ValueError(f"it has no {what}")
    return values[0]


def _text(data: bytes) -> str:
    return data.decode("utf-8")


def _grouped(data: bytes) -> dict[int, list[Any]]:
    """Values of the fields of a message by number, each in order."""
    fields: dict[int, list[Any]] = {}
    for number, value in _fields(data):
        fields.setdefault(number, []).append(value)
    return fields


def _fields(data: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Number and value of each field: an integer, or bytes for all other types."""
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        kind = key & 7
        if kind == 0:
            value, at = _varint(data, at)
            yield key >> 3, value
            continue
        if kind == 2:
            length, at = _varint(data, at)
        elif kind in (1, 5):
            length = 8 if kind == 1 else 4
        else:
            raise ValueError("it is not an ONNX file")
        if at + length > len(data):
            raise ValueError("it is truncated")
        yield key >> 3, data[at : at + length]
        at += length


def _varints(data: bytes) -> Iterator[int]:
    at = 0
    while at < len(data):
        value, at = _varint(data, at)
        yield value


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """An integer of variable length, and the position after it."""
    value = 0
    for shift in range(0, 70, 7):
        if at >= len(data):
            raise ValueError("it is truncated")
        byte = data[at]
        value |= (byte & 0x7F) << shift
        at += 1
        if byte < 0x80:
            return value, at
    raise ValueError("it is not an ONNX file")

"""A nano detection network to compare vision's time with: the layers of YOLO11n, written out, with random weights.

The time of a network does not depend on what its weights have learned. Layout: Ultralytics' yolo11.yaml at scale n
(depth 0.5, width 0.25), normalization folded into the convolutions, up to boxes and class scores; suppressing double
boxes is left out, which only favours the network.
"""

from __future__ import annotations

import importlib.util
import math
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

CLASSES = 10  # as many as vision has kinds of features
BINS = 16  # of the distribution over each side of a box
OPSET = 17
MISSING = "onnx and onnxruntime are not installed; install them with the extra `bench`: pip install -e '.[bench]'"


@dataclass(frozen=True)
class Tensor:
    """A value of the network: its name, channels, rows and columns."""

    name: str
    channels: int
    rows: int
    columns: int


@dataclass
class Network:
    """Collects the nodes of a network.

    Attributes:
        flops: Floating point operations of the convolutions and of attention: two for each product that is summed.
        weights: Number of weights.
    """

    flops: float = 0.0
    weights: int = 0
    nodes: list[Any] = field(default_factory=list)
    constants: list[Any] = field(default_factory=list)
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))

    def node(self, kind: str, inputs: list[str], outputs: int = 1, **attributes: Any) -> list[str]:
        """Add a node and return the names of its outputs."""
        from onnx import helper

        names = [f"v{len(self.nodes)}_{index}" for index in range(outputs)]
        self.nodes.append(helper.make_node(kind, inputs, names, **attributes))
        return names

    def constant(self, values: NDArray[Any]) -> str:
        """Add a constant and return its name."""
        from onnx import numpy_helper

        name = f"c{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(values, name))
        return name

    def conv(
        self, x: Tensor, channels: int, size: int = 1, stride: int = 1, groups: int = 1, active: bool = True
    ) -> Tensor:
        """Add a convolution, with the activation x sigmoid(x) if wanted."""
        shape = (channels, x.channels // groups, size, size)
        scale = math.sqrt(2.0 / (shape[1] * size * size))
        weights = self.constant((scale * self.rng.standard_normal(shape)).astype(np.float32))
        bias = self.constant(np.zeros(channels, dtype=np.float32))
        pads, rows, columns = [size // 2] * 4, -(-x.rows // stride), -(-x.columns // stride)
        (name,) = self.node("Conv", [x.name, weights, bias], strides=[stride, stride], pads=pads, group=groups)
        self.flops += 2.0 * math.prod(shape) * rows * columns
        self.weights += math.prod(shape) + channels
        if active:
            (gate,) = self.node("Sigmoid", [name])
            (name,) = self.node("Mul", [name, gate])
        return Tensor(name, channels, rows, columns)

    def add(self, one: Tensor, other: Tensor) -> Tensor:
        """Add two tensors."""
        return Tensor(self.node("Add", [one.name, other.name])[0], one.channels, one.rows, one.columns)

    def join(self, *parts: Tensor) -> Tensor:
        """Put tensors side by side."""
        (name,) = self.node("Concat", [part.name for part in parts], axis=1)
        return Tensor(name, sum(part.channels for part in parts), parts[0].rows, parts[0].columns)

    def halves(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """Divide a tensor by its channels."""
        half = x.channels // 2
        one, other = self.node("Split", [x.name, self.constant(np.array([half, half]))], outputs=2, axis=1)
        return Tensor(one, half, x.rows, x.columns), Tensor(other, half, x.rows, x.columns)

    def twice_as_large(self, x: Tensor) -> Tensor:
        """Double rows and columns."""
        scales = self.constant(np.array([1.0, 1.0, 2.0, 2.0], dtype=np.float32))
        (name,) = self.node("Resize", [x.name, "", scales], mode="nearest")
        return Tensor(name, x.channels, 2 * x.rows, 2 * x.columns)

    def bottleneck(self, x: Tensor, inner: int) -> Tensor:
        """Add two convolutions beside a short cut."""
        return self.add(x, self.conv(self.conv(x, inner, 3), x.channels, 3))

    def c3k2(self, x: Tensor, channels: int, deep: bool, share: float = 0.5) -> Tensor:
        """Add the block C3k2 with one repetition; a deep one has the block C3k inside."""
        first, second = self.halves(self.conv(x, 2 * int(channels * share)))
        if deep:
            inner = second.channels // 2
            way = self.conv(second, inner)
            for _ in range(2):
                way = self.bottleneck(way, inner)
            third = self.conv(self.join(way, self.conv(second, inner)), second.channels)
        else:
            third = self.bottleneck(second, second.channels // 2)
        return self.conv(self.join(first, second, third), channels)

    def sppf(self, x: Tensor) -> Tensor:
        """Add pooling over growing neighbourhoods."""
        parts = [self.conv(x, x.channels // 2)]
        for _ in range(3):
            last = parts[-1]
            (name,) = self.node("MaxPool", [last.name], kernel_shape=[5, 5], strides=[1, 1], pads=[2, 2, 2, 2])
            parts.append(Tensor(name, last.channels, last.rows, last.columns))
        return self.conv(self.join(*parts), x.channels)

    def c2psa(self, x: Tensor) -> Tensor:
        """Add attention of all places to all others, on half of the channels."""
        first, second = self.halves(self.conv(x, x.channels))
        second = self.add(second, self._attention(second))
        wide = self.conv(second, 2 * second.channels)
        second = self.add(second, self.conv(wide, second.channels, active=False))
        return self.conv(self.join(first, second), x.channels)

    def _attention(self, x: Tensor) -> Tensor:
        heads, places = x.channels // 64, x.rows * x.columns
        key, value = 32, 64
        both = self.conv(x, heads * (2 * key + value), active=False)
        (flat,) = self.node("Reshape", [both.name, self.constant(np.array([1, heads, 2 * key + value, places]))])
        sizes = self.constant(np.array([key, key, value]))
        query, keys, values = self.node("Split", [flat, sizes], outputs=3, axis=2)
        (turned,) = self.node("Transpose", [query], perm=[0, 1, 3, 2])
        (scores,) = self.node("MatMul", [turned, keys])
        (scaled,) = self.node("Mul", [scores, self.constant(np.array(key**-0.5, dtype=np.float32))])
        (shares,) = self.node("Softmax", [scaled], axis=-1)
        (turned,) = self.node("Transpose", [shares], perm=[0, 1, 3, 2])
        (mixed,) = self.node("MatMul", [values, turned])
        self.flops += 2.0 * heads * (key + value) * places * places
        shape = self.constant(np.array([1, x.channels, x.rows, x.columns]))
        out, plain = (
            Tensor(self.node("Reshape", [name, shape])[0], x.channels, x.rows, x.columns) for name in (mixed, values)
        )
        out = self.add(out, self.conv(plain, x.channels, 3, groups=x.channels, active=False))
        return self.conv(out, x.channels, active=False)

    def detect(self, x: Tensor, widest: int) -> str:
        """Add boxes and scores of one scale; return the name of (1, 4 + CLASSES, places)."""
        box = self.conv(self.conv(self.conv(x, 64, 3), 64, 3), 4 * BINS, active=False)
        score = self.conv(self.conv(x, x.channels, 3, groups=x.channels), widest)
        score = self.conv(self.conv(score, widest, 3, groups=widest), widest)
        score = self.conv(score, CLASSES, active=False)
        places = x.rows * x.columns
        (flat,) = self.node("Reshape", [box.name, self.constant(np.array([1, 4, BINS, places]))])
        (shares,) = self.node("Softmax", [flat], axis=2)
        bins = self.constant(np.arange(BINS, dtype=np.float32).reshape(1, 1, BINS, 1))
        (weighted,) = self.node("Mul", [shares, bins])
        (sides,) = self.node("ReduceSum", [weighted, self.constant(np.array([2]))], keepdims=0)
        (flat,) = self.node("Reshape", [score.name, self.constant(np.array([1, CLASSES, places]))])
        (scores,) = self.node("Sigmoid", [flat])
        return self.node("Concat", [sides, scores], axis=1)[0]


def build(width: int, height: int) -> tuple[bytes, Network]:
    """Return the network for pictures of a size, multiples of 32, as ONNX, and what it costs."""
    from onnx import TensorProto, helper

    network = Network()
    x = network.conv(Tensor("picture", 3, height, width), 16, 3, 2)
    x = network.c3k2(network.conv(x, 32, 3, 2), 64, False, 0.25)
    small = network.c3k2(network.conv(x, 64, 3, 2), 128, False, 0.25)
    middle = network.c3k2(network.conv(small, 128, 3, 2), 128, True)
    large = network.c3k2(network.conv(middle, 256, 3, 2), 256, True)
    large = network.c2psa(network.sppf(large))
    middle = network.c3k2(network.join(network.twice_as_large(large), middle), 128, False)
    small = network.c3k2(network.join(network.twice_as_large(middle), small), 64, False)
    middle = network.c3k2(network.join(network.conv(small, 64, 3, 2), middle), 128, False)
    large = network.c3k2(network.join(network.conv(middle, 128, 3, 2), large), 256, True)
    widest = max(small.channels, min(CLASSES, 100))
    scales = [network.detect(each, widest) for each in (small, middle, large)]
    (out,) = network.node("Concat", scales, axis=2)
    graph = helper.make_graph(
        network.nodes,
        "yolo11n",
        [helper.make_tensor_value_info("picture", TensorProto.FLOAT, [1, 3, height, width])],
        [helper.make_tensor_value_info(out, TensorProto.FLOAT, [1, 4 + CLASSES, None])],
        network.constants,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=8)
    return model.SerializeToString(), network


class Detector:
    """The network through ONNX Runtime on one thread."""

    def __init__(self, width: int, height: int) -> None:
        """Build it.

        Raises:
            RuntimeError: if onnx or onnxruntime is not installed.
        """
        if importlib.util.find_spec("onnx") is None or importlib.util.find_spec("onnxruntime") is None:
            raise RuntimeError(MISSING)
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        model, self.network = build(width, height)
        self._session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])

    def run(self, picture: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return (4 + CLASSES, places) box sides and scores of a picture, (height, width, 3) BGR."""
        blob = cv2.dnn.blobFromImage(picture, 1.0 / 255.0, swapRB=True)
        (out,) = self._session.run(None, {"picture": blob})
        return np.asarray(out[0], np.float32)

"""Writes operators.onnx and operators.txt: python3 make_operators.py (needs numpy and onnx).

A network of every portable operator on two frames of 20 x 20 bytes, byte number i being (37 i + 11) % 256, and its outputs
as NumPy computes them in double precision. One output a line.
"""

import pathlib

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

HERE = pathlib.Path(__file__).parent
random = np.random.default_rng(7)
nodes, weights = [], []


def constant(name, *shape, scale=1.0):
    values = (scale * random.standard_normal(shape)).astype(np.float32)
    weights.append(numpy_helper.from_array(values, name))
    return values.astype(np.float64)


def node(op, inputs, output, **attributes):
    nodes.append(helper.make_node(op, inputs, [output], **attributes))


def convolve(x, w, b, stride, pads):
    top, left, bottom, right = pads
    x = np.pad(x, ((0, 0), (top, bottom), (left, right)))
    windows = np.lib.stride_tricks.sliding_window_view(x, w.shape[2:], axis=(1, 2))[:, ::stride[0], ::stride[1]]
    return np.einsum("chwij,ocij->ohw", windows, w) + b[:, None, None]


def largest(x, kernel, stride, pads):
    top, left, bottom, right = pads
    x = np.pad(x, ((0, 0), (top, bottom), (left, right)), constant_values=-np.inf)
    windows = np.lib.stride_tricks.sliding_window_view(x, kernel, axis=(1, 2))[:, ::stride[0], ::stride[1]]
    return windows.max(axis=(3, 4))


x = ((37 * np.arange(800) + 11) % 256).reshape(2, 20, 20).astype(np.float64)
node("Cast", ["pictures"], "cast", to=TensorProto.FLOAT)
nodes.append(helper.make_node("Constant", [], ["whole"], value=numpy_helper.from_array(np.array(255, np.float32))))
node("Div", ["cast", "whole"], "scaled")
x = x / 255
w, b = constant("w1", 19, 2, 3, 5, scale=0.3), constant("b1", 19)
node("Conv", ["scaled", "w1", "b1"], "c1", kernel_shape=[3, 5], strides=[1, 2], pads=[1, 2, 0, 1])
x = convolve(x, w, b, (1, 2), (1, 2, 0, 1))
node("LeakyRelu", ["c1"], "l1", alpha=0.1)
x = np.where(x < 0, np.float64(np.float32(0.1)) * x, x)
node("MaxPool", ["l1"], "m1", kernel_shape=[3, 2], strides=[2, 1], pads=[1, 0, 0, 1])
x = largest(x, (3, 2), (2, 1), (1, 0, 0, 1))
s = constant("per_channel", 19, 1, 1)
node("Mul", ["per_channel", "m1"], "k1")
x = s * x
w = constant("w2", 33, 19, 3, 3, scale=0.08)
node("Conv", ["k1", "w2"], "c2", kernel_shape=[3, 3], strides=[2, 2], pads=[1, 1, 1, 1])
y = convolve(x, w, np.zeros(33), (2, 2), (1, 1, 1, 1))
node("Elu", ["c2"], "e2", alpha=0.7)
e = np.where(y < 0, np.float64(np.float32(0.7)) * np.expm1(y), y)
node("Tanh", ["c2"], "t2")
node("Sub", ["e2", "t2"], "s2")
x = e - np.tanh(y)
o = constant("offsets", 1, 33, 5, 1)
node("Add", ["s2", "offsets"], "a2")
x = x + o[0]
node("Identity", ["a2"], "i2")
node("GlobalAveragePool", ["i2"], "g2")
node("Flatten", ["g2"], "mean")
mean = x.mean(axis=(1, 2))
node("Flatten", ["i2"], "flat", axis=1)
w, b = constant("w3", 33, x.size, scale=0.05), constant("b3", 33)
node("Gemm", ["flat", "w3", "b3"], "n3", transB=1, alpha=0.5, beta=2.0)
x = 0.5 * (w @ x.ravel()) + 2 * b
node("Relu", ["n3"], "r3")
x = np.maximum(x, 0)
node("Add", ["r3", "mean"], "d3")
x = x + mean
w = constant("w4", 33, 70, scale=0.2)
node("MatMul", ["d3", "w4"], "n4")
x = x @ w
node("Sigmoid", ["n4"], "p4")
x = 1 / (1 + np.exp(-x))
w = constant("w5", 70, 4, scale=0.2)
node("Gemm", ["p4", "w5"], "way")
x = x @ w

graph = helper.make_graph(nodes, "operators",
                          [helper.make_tensor_value_info("pictures", TensorProto.FLOAT, [1, 2, 20, 20])],
                          [helper.make_tensor_value_info("way", TensorProto.FLOAT, [1, 4])], weights)
model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=7)
onnx.checker.check_model(model, full_check=True)
onnx.save(model, HERE / "operators.onnx")
(HERE / "operators.txt").write_text("".join(f"{value!r}\n" for value in x.tolist()))

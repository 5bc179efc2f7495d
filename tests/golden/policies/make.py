"""Writes the networks that tests of core/training/policies read: python3 make.py (needs torch and onnx).

tiny: two frames of 20 x 20 bytes, two axes. Axis 0 is the mean of the newest frame over 255, axis 1 half that of the frame
before. tiny-nan: the same with a weight of NaN, which the side file does not mention.

readings: one reading and two axes, a history of two latest captures and the best one. Axis 0 is a tenth of the newest reading,
axis 1 a tenth of the lowest.
"""

import hashlib
import json
import pathlib

import torch

SIZE, FRAMES = 20, 2
HERE = pathlib.Path(__file__).parent


def net(broken):
    linear = torch.nn.Linear(FRAMES * SIZE * SIZE, 2)
    with torch.no_grad():
        linear.bias.zero_()
        linear.weight.zero_()
        linear.weight[0, SIZE * SIZE:] = 1 / (255 * SIZE * SIZE)
        linear.weight[1, :SIZE * SIZE] = 0.5 / (255 * SIZE * SIZE)
        if broken:
            linear.weight[1, 7] = float("nan")
    return torch.nn.Sequential(torch.nn.Flatten(), linear)


def blocks(number):
    return bytes((37 * number + 11 * k) % 256 for k in range(FRAMES * 100))


def answer(picture):
    means = [sum(picture[frame * 100:][:100]) / 100 / 255 for frame in range(FRAMES)]
    return [means[1], 0.5 * means[0]]


for name in ("tiny", "tiny-nan"):
    graph = HERE / (name + ".onnx")
    torch.onnx.export(net(name != "tiny"), (torch.zeros(1, FRAMES, SIZE, SIZE),), str(graph), input_names=["pictures"],
                      output_names=["way"], opset_version=13, dynamo=False)
    inputs = [blocks(number) for number in range(3)]
    side = {
        "format": 1, "scene": "toy", "axes": ["u", "v"],
        "observation": {"size": SIZE, "frames": FRAMES, "white": 0.1, "byte_whites": 3.0},
        "output": "way", "command": "relign-train imitate --scene toy -o FOLDER",
        "weights_sha256": hashlib.sha256(graph.read_bytes()).hexdigest(),
        "reference": {"blocks": 2, "means": [0.0] * 4},
        "parity": {"inputs": [picture.hex() for picture in inputs], "answers": [answer(picture) for picture in inputs]},
    }
    graph.with_suffix(".json").write_text(json.dumps(side, indent=1) + "\n")

history = {"last": 2, "best": 1, "fine_move": 0.005}
slot, slots = 1 + 2 * 2 + 2, 3
linear = torch.nn.Linear(slots * slot, 2, bias=False)
with torch.no_grad():
    linear.weight.zero_()
    linear.weight[0, 2 * slot + 5] = linear.weight[1, 5] = 0.1
graph = HERE / "readings.onnx"
torch.onnx.export(linear, (torch.zeros(1, slots * slot),), str(graph), input_names=["history"], output_names=["way"],
                  opset_version=13, dynamo=False)
inputs = [bytes((37 * number + 11 * k) % 256 for k in range(slots * slot)) for number in range(3)]
side = {
    "format": 1, "scene": "toy", "axes": ["a0", "a1"],
    "observation": {"kind": "readings", "readings": [{"name": "loss"}], "mean": [0.0], "deviation": [1.0], "fine": [1.0],
                    "score": "loss", "history": history},
    "output": "way", "largest_move": 0.2, "command": "relign-train imitate --scene toy -o FOLDER",
    "weights_sha256": hashlib.sha256(graph.read_bytes()).hexdigest(), "reference": {"readings": [0.5]},
    "parity": {"inputs": [one.hex() for one in inputs],
               "answers": [[0.1 * (one[2 * slot + 5] - 128) / 32, 0.1 * (one[5] - 128) / 32] for one in inputs]},
}
graph.with_suffix(".json").write_text(json.dumps(side, indent=1) + "\n")

"""A trained network as one ONNX file and a side file that says what it is for."""

import hashlib
import json
import os
import pathlib
import platform

import numpy as np
import torch
from torch import nn

from ..batch import Batch
from ..conventions import BYTE_WHITES

PARITY_INPUTS = 64
PARITY_SIDE = 10  # each byte of a parity input is a block of size / 10 pixels
REFERENCE_BLOCKS = 20
OPSET = 13  # what OpenCV 4.6 reads
LARGEST_FILE = 4_000_000


class Actor(nn.Module):
    """The mean action of a Stable-Baselines3 policy, from bytes as floats."""

    def __init__(self, policy):
        super().__init__()
        self.features, self.action = policy.features_extractor, policy.action_net

    def forward(self, pictures):
        return self.action(self.features(pictures / 255))


def parity_blocks(frames, count=PARITY_INPUTS):
    """Inputs whose answers every program that runs the network must give: bytes from a fixed generator."""
    return np.random.default_rng(20250307).integers(0, 256, (count, frames, PARITY_SIDE, PARITY_SIDE), dtype=np.uint8)


def shown(blocks, size):
    """The same as the network takes them, (count, frames, size, size)."""
    rows = np.arange(size) * PARITY_SIDE // size
    return blocks[:, :, rows][:, :, :, rows]


def block_means(picture, blocks):
    """Means over blocks x blocks equal parts; sides of the picture are multiples of `blocks`."""
    height, width = picture.shape
    return picture.astype(np.float64).reshape(blocks, height // blocks, blocks, width // blocks).mean(axis=(1, 3))


def machine():
    """The processor's name."""
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def write(net, path, scene, size, frames, output, trained, command, reproducible="anywhere"):
    """PATH.onnx and PATH.json. Returns both paths.

    The graph takes bytes as float32, 1 x frames x size x size (255: BYTE_WHITES times a white pixel; the newest frame
    last), and gives per axis, in shares of the travel, the way to the optimum (output "way") or the next move ("move").
    trained: what the side file tells of recipe and cost. command: trains another one. reproducible: "anywhere" for a
    graph of portable operators (plugins/policies/README.md), as those of relign-train are; "this_cpu" has OpenCV run
    another graph, whose last digits depend on the processor.
    """
    path = pathlib.Path(path)
    net = net.eval()
    graph, side = path.with_suffix(".onnx"), path.with_suffix(".json")
    half = path.with_suffix(".half.onnx")
    torch.onnx.export(net, (torch.zeros(1, frames, size, size),), str(half), input_names=["pictures"],
                      output_names=[output], opset_version=OPSET, dynamo=False)
    os.replace(half, graph)
    blocks = parity_blocks(frames)
    with torch.no_grad():
        answers = [net(torch.from_numpy(picture[None]).float())[0].tolist() for picture in shown(blocks, size)]
    batch = Batch(1, scene, "rho0", threads=1)
    height, width = batch.reference.shape
    about = {
        "format": 1,
        "scene": scene,
        "scene_sha256": hashlib.sha256(json.dumps(batch.description, sort_keys=True).encode()).hexdigest(),
        "axes": [axis["name"] for axis in batch.description["axes"]],
        "observation": {"size": size, "frames": frames, "captured": [height, width], "white": batch.white,
                        "byte_whites": BYTE_WHITES},
        "output": output,
        "reproducible": reproducible,
        "command": command,
        "trained": {**trained, "instances": {"weights": "training", "checkpoint": "tuning"}, "torch": torch.__version__,
                    "machine": machine()},
        "weights_sha256": hashlib.sha256(graph.read_bytes()).hexdigest(),
        "reference": {"blocks": REFERENCE_BLOCKS,
                      "means": [float(f"{mean:.6g}") for mean in block_means(batch.reference, REFERENCE_BLOCKS).ravel()]},
        "parity": {"inputs": [picture.tobytes().hex() for picture in blocks],
                   "answers": [[float(f"{value:.7g}") for value in answer] for answer in answers]},
    }
    lines = ",\n".join(f" {json.dumps(name)}: {json.dumps(value)}" for name, value in about.items())
    side.write_text("{\n" + lines + "\n}\n")
    return [graph, side]

"""A trained network as one ONNX file and a side file that says what it is for."""

import hashlib
import json
import os
import pathlib
from dataclasses import asdict

import numpy as np
import torch

from ..batch import Batch
from ..conventions import BYTE_WHITES

PARITY_INPUTS = 64
OPSET = 13  # what OpenCV 4.6 reads


def parity_pictures(size, count=PARITY_INPUTS):
    """Bytes whose answers every program that runs the network must give: blocks of grey, from a fixed generator."""
    random = np.random.default_rng(20250307)
    blocks = random.integers(0, 256, (count, 10, 10), dtype=np.uint8)
    rows = np.arange(size) * 10 // size
    return blocks[:, rows][:, :, rows]


def write(net, path, training):
    """PATH.onnx and PATH.json. Returns both paths.

    The graph takes bytes as float32, 1 x 1 x size x size (255: BYTE_WHITES times a white pixel), and gives the move to the
    optimum in shares of the travel, 1 x axes.
    """
    path = pathlib.Path(path)
    net = net.eval()
    recipe = training.recipe
    graph, side = path.with_suffix(".onnx"), path.with_suffix(".json")
    half = path.with_suffix(".half.onnx")
    torch.onnx.export(net, (torch.zeros(1, 1, recipe.size, recipe.size),), str(half), input_names=["picture"],
                      output_names=["move"], opset_version=OPSET, dynamo=False)
    os.replace(half, graph)
    pictures = parity_pictures(recipe.size)
    with torch.no_grad():
        answers = np.concatenate([net(torch.from_numpy(picture[None, None]).float()).numpy() for picture in pictures])
    batch = Batch(1, recipe.scene, "rho0", threads=1)
    about = {
        "format": 1,
        "observation": {"size": recipe.size, "frames": 1, "binned_from": list(batch.reference.shape),
                        "white": batch.white, "byte_whites": BYTE_WHITES},
        "axes": [axis["name"] for axis in batch.description["axes"]],
        "scene": recipe.scene,
        "scene_hash": hashlib.sha256(json.dumps(batch.description, sort_keys=True).encode()).hexdigest(),
        "trained": {"recipe": asdict(recipe), "instances": "training", "seconds": round(training.seconds, 1),
                    "threads": training.threads or os.cpu_count(), "torch": torch.__version__},
        "weights_sha256": hashlib.sha256(graph.read_bytes()).hexdigest(),
        "parity": {"pictures": "10 x 10 blocks, numpy.random.default_rng(20250307)",
                   "inputs": [block.tolist() for block in pictures[:, ::recipe.size // 10, ::recipe.size // 10]]
                   if recipe.size % 10 == 0 else None,
                   "answers": [[float(f"{value:.7g}") for value in answer] for answer in answers]},
    }
    side.write_text(json.dumps(about, indent=1) + "\n")
    return [graph, side]

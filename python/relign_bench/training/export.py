"""A trained network as an ONNX file, with a side file that documents and verifies it."""

from __future__ import annotations

import hashlib
import json
import os
import pathlib
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import nn

from ..batch import Batch
from ..conventions import BYTE_WHITES
from .doubt import DRIFT
from .history import FINE_MOVE

if TYPE_CHECKING:
    from .._typing import AnyArray, ByteArray, Float64Array
    from .doubt import Doubt
    from .remember import Training as Remembering
    from .rewarded import Training as Rewarded

PARITY_INPUTS = 64
PARITY_SIDE = 10  # each byte of a parity input is a block of size / PARITY_SIDE pixels
REFERENCE_BLOCKS = 20
OPSET = 13  # the newest that OpenCV 4.6 reads


VALUES = {"uint8": "bytes", "float32": "irradiance"}
"""What side files call the inputs of environments."""


class Actor(nn.Module):
    """The mean action of a Stable-Baselines3 policy, from images of shape (batch, frames, height, width).

    Args:
        policy: The policy.
        observation: What the policy observes: "uint8", of which the images are the bytes as floats, or "float32".
    """

    def __init__(self, policy: Any, observation: str) -> None:
        super().__init__()
        self.features, self.head, self.action = policy.features_extractor, policy.mlp_extractor.policy_net, policy.action_net
        self.bytes = observation == "uint8"

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        """Actions, shape (batch, axes)."""
        return self.action(self.head(self.features(images / 255 if self.bytes else images)))


def parity_blocks(frames: int, count: int = PARITY_INPUTS) -> ByteArray:
    """Inputs whose outputs verify a program that runs the network: bytes from a generator with a fixed seed.

    Returns:
        Shape (count, frames, PARITY_SIDE, PARITY_SIDE).
    """
    return np.random.default_rng(20250307).integers(0, 256, (count, frames, PARITY_SIDE, PARITY_SIDE), dtype=np.uint8)


def enlarged(blocks: ByteArray, height: int, width: int | None = None) -> ByteArray:
    """Parity inputs at the network's size, shape (count, frames, height, width); without a width, of squares."""
    rows, columns = (np.arange(side) * PARITY_SIDE // side for side in (height, width or height))
    return blocks[:, :, rows][:, :, :, columns]


def block_means(image: AnyArray, blocks: int) -> Float64Array:
    """Means over blocks x blocks equal parts of an image whose sides are multiples of `blocks`."""
    height, width = image.shape
    return image.astype(np.float64).reshape(blocks, height // blocks, blocks, width // blocks).mean(axis=(1, 3))


def blocks_of(image: AnyArray, blocks: int) -> dict[str, Any]:
    """What the side file has of a reference image."""
    return {"blocks": blocks, "means": [float(f"{mean:.6g}") for mean in block_means(image, blocks).ravel()]}


def identity(batch: Batch, scene: str) -> dict[str, Any]:
    """What the side file has of a scene."""
    return {"format": 1, "scene": scene,
            "scene_sha256": hashlib.sha256(json.dumps(batch.description, sort_keys=True).encode()).hexdigest(),
            "axes": [axis["name"] for axis in batch.description["axes"]]}


def write_graph(net: nn.Module, path: str | os.PathLike[str], inputs: dict[str, torch.Tensor], output: str) -> pathlib.Path:
    """Writes a network as PATH.onnx, whole or not at all; returns the path.

    Args:
        net: The network.
        path: Path without or with the suffix.
        inputs: One example of each input, by name and in their order.
        output: Name of the output.
    """
    graph = pathlib.Path(path).with_suffix(".onnx")
    graph.parent.mkdir(parents=True, exist_ok=True)
    half = graph.with_suffix(".half.onnx")
    torch.onnx.export(net, tuple(inputs.values()), str(half), input_names=list(inputs), output_names=[output],
                      opset_version=OPSET, dynamo=False)
    os.replace(half, graph)
    return graph


def write_side(graph: pathlib.Path, about: dict[str, Any]) -> pathlib.Path:
    """Writes the side file of a network, a line for each key; returns its path.

    Raises:
        ValueError: A number is not finite: the training has failed.
    """
    side, lines = graph.with_suffix(".json"), []
    for name, value in about.items():
        try:
            lines.append(f" {json.dumps(name)}: {json.dumps(value, allow_nan=False)}")
        except ValueError:
            raise ValueError(f"{side} is not written, because '{name}' has a number that is not finite: the network of this "
                             "run cannot be used; train again with other settings") from None
    side.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    return side


def doubt_numbers(doubt: Doubt) -> dict[str, Any]:
    """The numbers of a Doubt, for the side file; directions as rows."""
    return {"directions": [[float(f"{value:.9g}") for value in row] for row in doubt.directions.T],
            "effects": [float(f"{value:.6g}") for value in doubt.effects],
            "floor": [float(f"{value:.6g}") for value in doubt.floor], "drift": DRIFT}


def write(net: nn.Module, path: str | os.PathLike[str], scene: str, size: int, frames: int, output: str,
          trained: dict[str, Any], command: str, reproducible: str = "anywhere", doubt: Doubt | None = None,
          values: str = "bytes", chosen_on: str = "tuning") -> list[pathlib.Path]:
    """Writes PATH.onnx and PATH.json.

    The graph takes float32, shape (1, frames, size, size), the newest frame last: bytes, with 255 at BYTE_WHITES times a white
    pixel, or irradiance in the scene's units. Per axis, in shares of the travel, it returns the residual to the optimum (output
    "way") or the next move ("move"). With `doubt`, the residual is followed by the logarithms of the standard deviations of its
    errors along the directions.

    Args:
        net: The network.
        path: Path without or with the suffix.
        scene: Id, preset or path of the scene.
        size: Rows and columns of the images.
        frames: Images in one input.
        output: "way" or "move".
        trained: Recipe and cost of the training, for the side file.
        command: The command that repeats the training.
        reproducible: "anywhere" for a graph of the operators that relign-bench runs itself
            (core/training/policies/README.md), as those of relign-train are. OpenCV runs other graphs: "this_cpu", since the
            last digits then depend on the processor.
        doubt: How answers are combined, for networks that predict their own errors.
        values: "bytes" or "irradiance".
        chosen_on: Instances that chose the checkpoint; "none" for the last one of a run.

    Returns:
        The two paths.
    """
    net = net.cpu().eval()
    graph = write_graph(net, path, {"pictures": torch.zeros(1, frames, size, size)}, output)
    batch = Batch(1, scene, "rho0", threads=1)
    blocks = parity_blocks(frames)
    unit = np.float32(BYTE_WHITES * batch.white / 255 if values == "irradiance" else 1)
    with torch.no_grad():
        answers = [net(torch.from_numpy(image[None] * unit))[0].tolist()
                   for image in enlarged(blocks, size).astype(np.float32)]
    height, width = batch.reference.shape
    about = {
        **identity(batch, scene),
        "observation": {"size": size, "frames": frames, "captured": [height, width], "white": batch.white,
                        "byte_whites": BYTE_WHITES, **({} if values == "bytes" else {"values": values})},
        "output": output,
        **({} if doubt is None else {"doubt": doubt_numbers(doubt)}),
        "reproducible": reproducible,
        "command": command,
        "trained": {**trained, "instances": {"weights": "training", "checkpoint": chosen_on}},
        "weights_sha256": hashlib.sha256(graph.read_bytes()).hexdigest(),
        "reference": blocks_of(batch.reference, REFERENCE_BLOCKS),
        "parity": {"inputs": [image.tobytes().hex() for image in blocks],
                   "answers": [[float(f"{value:.7g}") for value in answer] for answer in answers]},
    }
    return [graph, write_side(graph, about)]


def write_remembering(net: nn.Module, path: str | os.PathLike[str], training: Remembering | Rewarded, trained: dict[str, Any],
                      command: str, output: str = "way", chosen_on: str = "none") -> list[pathlib.Path]:
    """Writes PATH.onnx and PATH.json of a network with a history (remember.py), which agents run.

    Args:
        net: The network.
        path: Path without or with the suffix.
        training: Has the pool of instances, the format of the history, the probes and the recipe.
        trained: Recipe and cost of the training, for the side file.
        command: The command that repeats the training.
        output: "way" or "move".
        chosen_on: As for `write`.

    Returns:
        The two paths.
    """
    net = net.cpu().eval()
    pool, form, recipe = training.pool, training.format, training.recipe
    batch, frames = pool.batch, recipe.frames if pool.images else 0  # type: ignore[union-attr]
    blocks = parity_blocks(frames)
    numbers = np.random.default_rng(20250308).integers(0, 256, (PARITY_INPUTS, form.count), dtype=np.uint8)
    inputs = {"pictures": torch.from_numpy(enlarged(blocks, *pool.shape).astype(np.float32))} if pool.images else {}
    inputs["history"] = torch.from_numpy((numbers.astype(np.float32) - 128) / 32)
    graph = write_graph(net, path, {name: part[:1] for name, part in inputs.items()}, output)
    with torch.no_grad():
        answers = net(*inputs.values()).tolist()
    observation: dict[str, Any] = {"kind": "images" if pool.images else "readings"}
    reference: dict[str, Any] = {"readings": [float(value) for value in pool.readings_of(batch.reference[None])[0]]}
    if pool.images:
        height, width = pool.reference.shape
        observation.update(size=pool.shape[1], frames=frames, captured=[height, width], white=batch.white,
                           byte_whites=BYTE_WHITES)
        if pool.shape[0] != pool.shape[1]:
            observation["rows"] = pool.shape[0]
        blocked = max(k for k in range(1, REFERENCE_BLOCKS + 1) if height % k == width % k == 0)
        reference = blocks_of(pool.reference, blocked)
    if pool.readings:
        observation["readings"] = [{key: one[key] for key in ("name", "unit") if key in one} for one in pool.readings]
        observation.update(mean=form.mean.tolist(), deviation=form.deviation.tolist(), fine=form.fine.tolist())
        if form.score is not None:
            observation["score"] = pool.readings[form.score]["name"]
    observation["history"] = {"last": form.last, "best": form.best, "fine_move": FINE_MOVE}
    probes = {} if not len(training.probes[0]) else {
        "probes": {"poses": training.probes[0].tolist(), "until": training.probes[1]}}
    about = {
        "use": "network",
        **identity(batch, recipe.scene),
        "observation": observation,
        "output": output,
        "largest_move": recipe.largest_move,
        **probes,
        "command": command,
        "trained": {**trained, "instances": {"weights": "training", "checkpoint": chosen_on}},
        "weights_sha256": hashlib.sha256(graph.read_bytes()).hexdigest(),
        "reference": reference,
        "parity": {"inputs": [(image.tobytes() + row.tobytes()).hex() for image, row in zip(blocks, numbers)],
                   "answers": [[float(f"{value:.7g}") for value in answer] for answer in answers]},
    }
    return [graph, write_side(graph, about)]

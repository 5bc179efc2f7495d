"""Directions in pose space, by how strongly they change the image."""

from __future__ import annotations

import numpy as np

from ..batch import Batch


class Directions:
    """Eigenvectors of J'J, with J the derivative of the noise-free image by the pose at the design's optimum.

    Args:
        scene: Id, preset or path of a scene.
        size: Columns of the image.
        step: Step of the central differences, as a share of the travel.

    Attributes:
        vectors: One direction per column, the one with the strongest effect first; shape (axes, axes).
        values: Mean squared change of a pixel per squared unit of travel, shape (axes,): an error e from the optimum gives an
            MSE of about sum(values * (vectors.T @ e)**2).
        stiff: Number of stiff directions, which are the first: image shift, seen a hundred times as precisely as the others.

    Raises:
        ValueError: The scene is unknown, or renders no noise-free images.
    """

    def __init__(self, scene: str, size: int, step: float = 0.01) -> None:
        batch = Batch(1, scene, "rho", noise_level_parameters={"level": 0.0}, size=size, threads=1)
        batch.reset([0], [0])
        columns = []
        for axis in range(batch.axes):
            ends = []
            for sign in (-1, 1):
                pose = batch.nominal_pose.copy()
                pose[axis] += sign * step
                ends.append(batch.render_at([0], pose[None])[0])
            columns.append((ends[1] - ends[0]).ravel() / (2 * step))
        jacobian = np.array(columns, np.float64).T
        values, vectors = np.linalg.eigh(jacobian.T @ jacobian / len(jacobian))
        self.values, self.vectors = values[::-1].copy(), vectors[:, ::-1].copy()
        self.stiff = 2

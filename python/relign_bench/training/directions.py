"""Which changes of pose a picture tells well, and which badly."""

import numpy as np

from ..batch import Batch


class Directions:
    """Eigenvectors of J'J, J the derivative of the noise-free picture by the pose at the design's optimum.

    vectors (axes, axes): one direction a column, best told first. values: mean squared change of a pixel per squared
    unit of travel, so that an error e from the optimum costs an MSE of about sum(values * (vectors.T @ e)**2).
    stiff: the first two, image shift, which a picture tells to a hundredth of what it tells of the others.
    """

    def __init__(self, scene, size, step=0.01):
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

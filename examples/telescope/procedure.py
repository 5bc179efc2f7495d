"""What the observatory does: fit the donuts by those of a model, and correct what the wavefront's sensitivity tells.

It knows the design, its sensitivity and how donuts are made, but no zero of a hexapod, no figure error and no seeing.
"""
from telescope import AXES, BACKGROUND, MIRRORS, TILE, ZERNIKES, corrected, np, optics, residuals_nm, telescope_at

from relign_bench.plugin import Optimizer, parameter, serve

FIGURES = len(ZERNIKES)  # of M1 alone: the same errors of M2 look alike
STEPS = np.array([0.02 * half for _, _, half in AXES] + [40.0] * FIGURES + [0.05]) if np else None
# Standard deviations of what is fitted before an image: position, figure, and seeing about 0.7 arcsec.
PRIOR = np.array([half / 2 for _, _, half in AXES] + [40.0] * FIGURES + [0.2]) if np else None
SEEING = 0.7
BIN = 2  # pixels of a fitted one


def binned(tiles):
    rows, columns = tiles.shape
    return tiles.reshape(rows // BIN, BIN, columns // BIN, BIN).sum(axis=(1, 3))


def model(state):
    """Donuts, each with a light of 1, by ten positions in mm and deg, figure in nm and seeing."""
    telescope = telescope_at(state[:len(AXES)], {MIRRORS[0]: state[len(AXES):-1]})
    return normalised(binned(np.nan_to_num(optics.donuts(telescope, max(SEEING + state[-1], 0.1)))))


def normalised(tiles):
    """Each tile by its own light."""
    side = TILE // BIN
    parts = tiles.reshape(2, side, 4, side)
    return (parts / np.maximum(parts.sum(axis=(1, 3), keepdims=True), 1e-9)).ravel()


class ActiveOptics(Optimizer):
    id = "fit-donuts"
    observes = ("images", "box")

    rounds = parameter(3, minimum=1, maximum=20, description="Gauss-Newton steps of a fit")
    kept = parameter(7, minimum=1, maximum=10, description="Directions that are corrected, from the largest effect down")
    captures = parameter(8, minimum=1, maximum=1000, description="After these it stops")

    def run(self, trial):
        seen, state = trial.first, np.zeros(len(PRIOR))
        for _ in range(int(self.captures)):
            state = self.fitted(np.asarray(seen.image, dtype=float), state)
            residuals = residuals_nm(state[:len(AXES)], {MIRRORS[0]: state[len(AXES):-1]})
            if not np.isfinite(residuals).all():
                state[:len(AXES)] *= 0.5
                continue
            move = corrected(residuals, int(self.kept)) / 2
            before = np.asarray(seen.pose)
            seen = trial.step(trial.box.clamp(list(before + move)))
            if seen is None:
                return
            moved = np.asarray(seen.pose) - before
            state[:len(AXES)] += [2 * m * half for m, (_, _, half) in zip(moved, AXES)]
            trial.recommend(seen.pose)

    def fitted(self, image, state):
        """The state whose donuts are those of the image: least squares with the noise of photons and the prior."""
        light = binned(image[:-1] * 1000 - BACKGROUND)
        measured = normalised(light.clip(0.0))
        total = light.clip(0.0).sum() / 8
        deviation = np.sqrt(np.maximum(measured, 0) / total + 2 * BIN**2 * BACKGROUND / total**2)
        lowest = None
        for _ in range(int(self.rounds) + 1):
            expected = model(state)
            difference = (measured - expected) / deviation
            cost = difference @ difference + np.sum((state / PRIOR) ** 2)
            if lowest is not None and not cost < lowest[0]:
                state = lowest[1] + 0.3 * (state - lowest[1])
                continue
            lowest = cost, state.copy()
            scaled = self.slopes(state, expected) / deviation[:, None]
            step = np.linalg.solve(scaled.T @ scaled + np.diag(PRIOR**-2), scaled.T @ difference - state / PRIOR**2)
            state = state + step
        return lowest[1]

    @staticmethod
    def slopes(state, expected):
        columns = []
        for place, step in enumerate(STEPS):
            beside = state.copy()
            beside[place] += step
            columns.append((model(beside) - expected) / step)
        return np.stack(columns, axis=1)


if __name__ == "__main__":
    serve(ActiveOptics)

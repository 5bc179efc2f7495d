"""Checks of one image of a white target, for corpus.py: symmetry, rings, black pixels."""

import math

import numpy as np

# A rotationally symmetric lens and a square sensor are equal to themselves rotated by 90 degrees, up to sampling noise. Block
# means of correct lenses differ by 0.01 to 0.04.
ASYMMETRY_ALLOWED = 0.05
# Blocks against the profile over all rings: this also detects faults with the symmetry of the sensor.
RING_ALLOWED = 0.05
# A ring mean is an average over its width: the profile's curvature over it, for steep vignetting.
RING_WIDTH_PIXELS = 1.0
BLOCK = 8  # pixels
# Relative to the mean: a black pixel, and lit neighbours. At the edge of the lit disc few rays pass, and sampling noise makes
# single pixels black beside others of 0.15.
DARK, LIT = 0.02, 0.3


def blocks(values):
    rows, columns = (side // BLOCK * BLOCK for side in values.shape)
    return values[:rows, :columns].reshape(rows // BLOCK, BLOCK, columns // BLOCK, BLOCK).mean(axis=(1, 3))


class Profile:
    """Means over rings one pixel wide around the centre of the image."""

    def __init__(self, pixels):
        middle = (pixels.shape[0] - 1) / 2
        y, x = np.indices(pixels.shape) - middle
        self.radius, self.pixels = np.hypot(x, y), pixels
        self.azimuth = np.degrees(np.arctan2(y, x))
        ring = np.floor(self.radius).astype(int).ravel()
        count = np.bincount(ring)
        self.means = np.bincount(ring, pixels.ravel()) / np.maximum(count, 1)
        self.places = np.bincount(ring, self.radius.ravel()) / np.maximum(count, 1)

    def smooth(self):
        return np.interp(self.radius, self.places, self.means)

    def at(self, place):
        """(mean of the pixels near the diagonals at this radius, standard error, its error as a point)."""
        off = np.abs((self.azimuth + 90) % 90 - 45)
        chosen = (np.abs(self.radius - place) < max(RING_WIDTH_PIXELS, 1.5 if place < 2 else 0)) & (
            (off < 15) | (place < 8)
        )
        values, radii = self.pixels[chosen], self.radius[chosen]
        # The profile is not constant over a ring: a line removes its slope, and its curvature remains.
        line = np.polyfit(radii - place, values, 1) if radii.size > 8 and place > 2 else [0, values.mean()]
        rest = values - np.polyval(line, radii - place)
        i = int(np.clip(np.searchsorted(self.places, place), 2, self.means.size - 3))
        bend = np.abs(np.diff(self.means[i - 2 : i + 3], 2)).max() / 4
        return float(line[-1]), float(rest.std() / math.sqrt(values.size)), float(bend)


def look_at_image(pixels, row):
    mean = pixels.mean()
    if not np.isfinite(pixels).all() or not mean > 0:
        row.fail("image", "black" if np.isfinite(pixels).all() else "pixels that are not finite")
        return
    turned = [np.rot90(pixels, k) for k in (1, 2, 3)]
    asymmetry = np.abs(blocks(pixels - turned[0])).max() / mean
    row["asymmetry"] = f"{asymmetry:.4f}"
    if asymmetry > ASYMMETRY_ALLOWED:
        row.fail("asymmetry", f"{asymmetry:.3f}")
    # A fault that is symmetric itself: blocks against their ring, away from the edge of the lit disc.
    profile = Profile(pixels)
    steep = np.abs(np.gradient(profile.means)) * 2 > RING_ALLOWED / 2 * mean
    at_edge = np.interp(profile.radius, profile.places, steep.astype(float)) > 0
    deviation = np.where(at_edge, 0, pixels - profile.smooth())
    ring_error = np.abs(blocks(deviation)).max() / mean
    row["ring_error"] = f"{ring_error:.4f}"
    if ring_error > RING_ALLOWED:
        row.fail("rings", f"{ring_error:.3f} off the mean of the ring")
    missing = (pixels < DARK * mean) & (np.median(turned, axis=0) > LIT * mean)
    padded = np.pad(pixels, 1, mode="edge")
    rows, columns = pixels.shape
    places = [(i, j) for i in range(3) for j in range(3) if (i, j) != (1, 1)]
    around = [padded[i : i + rows, j : j + columns] for i, j in places]
    missing |= (pixels < DARK * mean) & (np.min(around, axis=0) > LIT * mean)
    row["missing_pixels"] = int(missing.sum())
    if missing.any():
        row.fail("black pixels", f"{int(missing.sum())} where rotated or neighbouring ones are lit")

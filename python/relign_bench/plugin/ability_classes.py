"""Optional abilities of a scene's assemblies.

Made by core/plugin_api/generate.py from scene.toml.
"""

from __future__ import annotations

from .ability import Ability

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    Pose = tuple[float, ...]


class AssemblyAbilities:
    """Optional methods of an assembly; override those that the scene offers.

    Each returns None when this assembly does not offer it. Poses are true poses.
    """

    def render_noise_free(self, pose: Pose) -> Any:
        """A noise-free image, for pictures and reports.

        Returns:
            pixels.
        """
        return None

    def render_average(self, pose: Pose, seed: int, error: float, samples: int) -> tuple[Any, float, int] | None:
        """A noise-free image averaged to a stated standard error, for render --noise-free --error.

        Averages until the standard error of a pixel is at most error (positive, in pixel values), or until a bound of
        the scene's own; if samples is above 0, instead that many samples per pixel (rounded up by the scene). What was
        reached may be more than error. Other seeds give independent images. A scene whose render_noise_free is exact
        does not need it.

        Returns:
            (pixels, standard_error, samples_used). standard_error: of a pixel, as root mean square over all pixels.
                samples_used: rays (or what the scene averages) per pixel that were used.
        """
        return None

    def render_slopes(self, pose: Pose, seed: int, samples: int, elements: Sequence[int]) -> Any:
        """A noise-free image and its derivatives, for render --derivatives and the service model.

        The image averages samples rays per pixel (or what the scene averages), at least 1; behind it come its
        derivatives, from the same rays: in the order of the axes, each per whole travel of its axis; then for each of
        elements (numbered from 0 in the order of the description, each at most once) five by its offsets: shift_mm x,
        y, z (per mm) and tilt_deg x, y (per degree). Other seeds give independent images.

        Returns:
            pixels.
        """
        return None

    def own_optimum(self, seed: int) -> tuple[Pose, float, float] | None:
        """The pose at which a lens as built is best.

        Results are compared with it ("excess": what an algorithm could still gain). Algorithms never observe it.

        Returns:
            (true_pose, mse, standard_error). true_pose: with the lowest noise-free MSE that the scene can find. mse: an
                unbiased estimate there, in squared pixel values. standard_error: of that estimate.
        """
        return None

    def further_score(self, pose: Pose, seed: int, which: int) -> float | None:
        """A further score at a pose; required of scenes that declare some.

        which numbers those of the description's score ("further") from 0 in its order. Noise-free, from 0, in the unit
        of the description, the better the lower. Algorithms never observe it. seed selects a random stream that no
        capture uses.

        Returns:
            value.
        """
        return None

    def mtf(self, pose: Pose, lp_per_mm: float) -> tuple[float, float] | None:
        """MTF at points of the field; required by suites with "spec": {"mtf": ...}.

        The geometric MTF of the lens itself, from rays: without noise, diffraction, pixels and reflections. Algorithms
        never observe it. At a point of the field it is that of the light in the plane of the sensor, for lp_per_mm
        (positive) line pairs per millimetre there, over all wavelengths of the scene; the lower one of sagittal and
        tangential lines; 0 where no light arrives. Points of the field are places of the target, the same for every
        lens and pose.

        Returns:
            (centre, corner). centre: in the middle of that part of the target whose ideal (undistorted) image is on the
                sensor. corner: 0.8 of the way from there to each of the part's four corners; the lowest value of the
                four, because a tilted lens blurs each of them differently.
        """
        return None

    def fields(self, pose: Pose, lp_per_mm: float, which: Sequence[int]) -> Sequence[tuple[float, float, float, float]] | None:
        """Where a lens images the fields, and how sharply; required by suites with field_mtf.

        Places and MTF of fields of the scene's description, numbered by which from 0 in its order. Algorithms never
        observe them. A field's point is a point of the target, the same for every lens and pose: the one that the
        design images onto the field's mark or, without a mark, onto the middle of its regions. Its place is the
        centroid of the light of that point in the plane of the sensor. The MTF (tangential, sagittal) is that of the
        ability "mtf", for line pairs across the field's two edges; without edges on the target, along and across the
        radius. It is 0, and the place NaN, where no light arrives.

        Returns:
            (x_px, y_px, tangential, sagittal), for each of which. x_px: from the centre of the first column. y_px: from
                the centre of the top row.
        """
        return None

    def capture_regions(self, pose: Pose, seed: int, regions: Sequence[tuple[int, int, int, int]]) -> tuple[Any, float] | None:
        """Captures of regions that an algorithm selects.

        As capture, for the pixels of some regions, at least one, as sensors with regions of interest read them out. A
        scene without it captures whole frames only. A region has at least one pixel and is inside the image; regions
        may overlap. Every pixel of the regions is written, the same bits as in the whole capture, into a whole image,
        in which the host sets the others to 0. Only of a scene with captures_regions = True.

        Returns:
            (pixels, share). share: the pixels that are read out as a share of those of a whole capture, by which
                "readout_ms" of the description is multiplied.
        """
        return None


class SceneAbilities:
    """What the scene says beforehand about its assemblies."""

    captures_regions = False  # whether its assemblies have capture_regions


ABILITIES = {
    "render_noise_free": Ability(
        arguments={"pose": "numbers"},
        results={"pixels": "pixels"},
    ),
    "render_average": Ability(
        arguments={"pose": "numbers", "seed": "integer", "error": "number", "samples": "integer"},
        results={"pixels": "pixels", "standard_error": "error", "samples_used": "integer"},
    ),
    "render_slopes": Ability(
        arguments={"pose": "numbers", "seed": "integer", "samples": "count", "elements": "counts"},
        results={"pixels": "pixels of axes + 1 + 5 elements images"},
    ),
    "own_optimum": Ability(
        arguments={"seed": "integer"},
        results={"true_pose": "pose", "mse": "finite", "standard_error": "error"},
    ),
    "further_score": Ability(
        arguments={"pose": "numbers", "seed": "integer", "which": "count"},
        results={"value": "finite"},
    ),
    "mtf": Ability(
        arguments={"pose": "numbers", "lp_per_mm": "number"},
        results={"centre": "fraction", "corner": "fraction"},
    ),
    "fields": Ability(
        arguments={"pose": "numbers", "lp_per_mm": "number", "which": "counts"},
        results={"x_px": "number", "y_px": "number", "tangential": "fraction", "sagittal": "fraction"},
        each="which",
    ),
    "capture_regions": Ability(
        arguments={"pose": "numbers", "seed": "integer", "regions": "regions"},
        results={"pixels": "pixels", "share": "fraction"},
        offered="captures_regions",
    ),
}
"""By name; what the messages to an assembly contain."""

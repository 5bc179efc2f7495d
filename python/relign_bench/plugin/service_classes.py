"""Services of a trial as classes.

Made by core/plugin_api/generate.py from services.toml.
"""

from __future__ import annotations

from .service import Service, TrialWithServices, number_or_nan, rows

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from typing import Any


class Measures(Service):
    """Measures of the last capture, by name."""

    ID = "relign.measures/1"

    def list(self) -> Any:
        """The names of all measures.

        [{"name": "mtf", "summary": "...", "arguments": {"cycles_per_pixel": "...", ...}}, ...]; a summary states the
        unit.
        """
        return self._ask("list")["measures"]

    def measure(self, name: str, arguments: Mapping[str, Any] | None = None) -> float:
        """One measure of the last capture.

        NaN when this capture does not allow it (no light, no edge in the region); that is not a failure.

        Raises:
            ValueError: An unknown measure, or arguments that it does not take.
        """
        return number_or_nan(self._ask("measure", name=name, arguments=dict(arguments or {}))["value"])

    def fields(self, arguments: Mapping[str, Any] | None = None) -> Sequence[dict[str, Any]]:
        """The slanted edges of the last capture, all fields in the time of one.

        They have the order of the scene's "fields". arguments: {"cycles_per_pixel": 0.1} or {"lp_per_mm": 50}. NaN: not
        in this capture.

        Returns:
            For each row {"name", "mark_x_px", "mark_y_px", "tangential", "sagittal"}: name: of the field; mark_x_px:
                centre of the field's mark, from the middle of the first column; mark_y_px: from the middle of the top
                row; tangential: MTF, pixel included; sagittal: MTF, pixel included.

        Raises:
            ValueError: Other arguments, or a scene without fields.
        """
        return rows(self._ask("fields", arguments=dict(arguments or {}))["fields"])


class Regions(Service):
    """The next capture reads out some regions only, in less readout time.

    Inside the regions pixels are those of the whole frame, bit for bit; the others are 0. The merit of such a capture
    is computed from its regions; it never counts as the best measured one.

    Attributes:
        most: How many regions select accepts.
    """

    ID = "relign.regions/1"
    MEMBERS = ("most",)
    most: int

    def select(self, regions: Iterable[Sequence[int]]) -> bool:
        """Selects what the next capture of this trial reads out.

        Captures after it are whole frames again. A rectangle has at least one pixel and is inside the image; rectangles
        may overlap; none: the whole frame. relign.run/1 starts with whole frames.

        Returns:
            False: the scene captures whole frames only, and nothing is selected.

        Raises:
            ValueError: No such rectangles.
        """
        answer = self._trial._answer(self.ID, "select", regions=[[int(value) for value in region] for region in regions])
        return answer["message"] != "unsupported"


class Prior(Service):
    """Draws from the noise level's distribution.

    Draws use training seeds: they are never the instance of this trial or of any benchmark. A station does not offer
    it.
    """

    ID = "relign.prior/1"

    def draw(self, number: int) -> Any:
        """Draw number of the perturbations.

        As relign_noise_level_interface::draw writes it: {"start": [...], "distortion": [[...]], "elements": {...}}, and
        "cure_shift" (of which the batch's mean is a part), "stage" and "batch" where the level draws them. The same
        number is the same draw in every trial of this level and scene.

        Raises:
            RuntimeError: The noise level failed.
        """
        return self._ask("draw", number=number)["drawn"]


class History(Service):
    """What inspection measured on earlier modules of the batch.

    The glue of modules from one batch cures alike: their shifts have a common mean, which a method can learn from the
    modules before and aim off by it. Measured shifts are a function of the instances alone, whichever method aligned
    the earlier modules and in whatever order trials ran.

    Attributes:
        modules: Earlier modules of this batch; 0 for its first, on a station, and at a level without batches.
    """

    ID = "relign.history/1"
    MEMBERS = ("modules",)
    modules: int

    def cure_shift(self, back: int) -> tuple[float, ...]:
        """The measured shift of the module back places before this one.

        back: 1 to modules. The shift is the true pose after curing minus that before, with the errors of inspection, in
        fractions of the travel.

        Raises:
            ValueError: Another module.
            RuntimeError: The noise level failed.
        """
        return tuple(map(float, self._ask("cure_shift", back=back)["shift"]))


class TrialServices(TrialWithServices):
    """The services as members of a trial."""

    def measures(self) -> Measures:
        """Measures of the last capture, by name. Needs "images"."""
        return self._made(Measures)

    def regions(self) -> Regions:
        """The next capture reads out some regions only, in less readout time. Needs "images"."""
        return self._made(Regions)

    def prior(self) -> Prior:
        """Draws from the noise level's distribution. Needs "level"."""
        return self._made(Prior)

    def history(self) -> History:
        """What inspection measured on earlier modules of the batch. Needs "history"."""
        return self._made(History)

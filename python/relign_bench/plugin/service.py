"""What the classes of a trial's services share."""

from __future__ import annotations

import json
import math

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any, TypeVar

    from .process import Host

    Made = TypeVar("Made", bound="Service")


class Stopped(BaseException):
    """Raised by long-running services (prior, model) once the user has stopped the run.

    Let it pass: it ends `run` and is not a failure. It is not an Exception, so that an `except Exception` does not continue
    by mistake.
    """


class TrialWithServices:
    """A trial's messages to the services of the host.

    Args:
        host: The other end of the messages.
        task: The message that describes the trial.
    """

    def __init__(self, host: Host, task: dict[str, Any]) -> None:
        self._host = host
        self.axes: list[dict[str, Any]] = task["axes"]
        self._services: dict[type[Service], Any] = {}

    def _made(self, service: type[Made]) -> Made:
        """The service's object, one for the whole trial."""
        if service not in self._services:
            self._services[service] = service(self)
        return self._services[service]  # type: ignore[no-any-return]

    def _service(self, service: str, call: str, **arguments: Any) -> dict[str, Any]:
        return self._offered(self._answer(service, call, **arguments))

    def _answer(self, service: str, call: str, **arguments: Any) -> dict[str, Any]:
        """The host's answer, "unsupported" included."""
        answer = self._host.ask(self._request(service, call, arguments))
        if answer["message"] == "stop":
            raise Stopped()
        return answer

    @staticmethod
    def _request(service: str, call: str, arguments: dict[str, Any]) -> str:
        request = dict(arguments, message="service", service=service, call=call)
        return json.dumps(request, allow_nan=False) + "\n"

    @staticmethod
    def _offered(answer: dict[str, Any]) -> dict[str, Any]:
        if answer["message"] == "unsupported":
            raise RuntimeError(answer.get("text", "the host does not offer this service"))
        return answer

    def _finite(self, pose: Iterable[float]) -> list[float]:
        values = [float(value) for value in pose]
        if not all(map(math.isfinite, values)):
            raise ValueError(f"a pose must be finite, found {values}")
        if len(values) != len(self.axes):
            raise ValueError(f"a pose must have {len(self.axes)} values, one per axis, found {len(values)}")
        return values


class Service:
    """A service of a trial. What does not change during the trial are its attributes."""

    ID = ""
    MEMBERS: tuple[str, ...] = ()

    def __init__(self, trial: TrialWithServices) -> None:
        self._trial = trial
        members = trial._service(self.ID, "open")
        for name in self.MEMBERS:
            setattr(self, name, members[name])

    def _ask(self, call: str, **arguments: Any) -> dict[str, Any]:
        return self._trial._service(self.ID, call, **arguments)


def number_or_nan(value: float | None) -> float:
    """A number of a message, where NaN is null."""
    return math.nan if value is None else float(value)


def rows(table: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows of a message, with NaN for null."""
    return [{key: math.nan if value is None else value for key, value in row.items()} for row in table]

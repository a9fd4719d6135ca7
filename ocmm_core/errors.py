"""The error tree of the product: a stable code, a sentence with file, line or field, a remedy."""

from __future__ import annotations

_LONGEST = 2000
"""Characters of a sentence: those about two paths are shorter, those of a hostile name are not."""


class OcmmError(Exception):
    """Base of every error that the product raises on purpose.

    ``code``: stable identifier, lower case with dots, e.g. ``"plan.no_features"``; ``what``: one
    sentence on what is wrong and where; ``remedy``: one sentence.
    """

    def __init__(self, code: str, what: str, remedy: str) -> None:
        self.code = code
        self.what = _readable(what)
        self.remedy = _readable(remedy)
        super().__init__(f"{self.what} {self.remedy}")

    def __reduce__(self) -> tuple[type[OcmmError], tuple[str, str, str]]:
        return (type(self), (self.code, self.what, self.remedy))


def _readable(sentence: str) -> str:
    """Return a sentence without the middle of a name that somebody made endless."""
    if len(sentence) <= _LONGEST:
        return sentence
    return f"{sentence[: _LONGEST // 2]} ... {sentence[-_LONGEST // 4 :]}"


class InputError(OcmmError):
    """A file, a document or an argument cannot be used as it is."""


class BusError(OcmmError):
    """The field bus cannot be opened or kept running."""


class AcquisitionError(OcmmError):
    """Frames cannot be acquired, buffered, recorded or replayed."""


class TrackingError(OcmmError):
    """The probe cannot be identified or located without doubt."""


class CalibrationError(OcmmError):
    """Cameras cannot be calibrated from what was taken, or may not be used as they are."""


class FitError(OcmmError):
    """A feature cannot be fitted to the points that were taken."""


class MeasuringError(OcmmError):
    """A point or a result cannot be given, and nothing doubtful is given instead."""


class StorageError(OcmmError):
    """A job, a record or a report cannot be written or read."""


class InternalError(OcmmError):
    """A part of the program failed in a way that nobody foresaw; see `ocmm_core.failure`."""

"""The one error tree of the product.

Every error that can reach a person carries a stable code, one clear sentence that says
what is wrong (naming the file, the line or the field) and what to do about it.
"""

from __future__ import annotations


class OcmmError(Exception):
    """Base of every error that the product raises on purpose.

    Parameters
    ----------
    code
        Stable identifier, lower case with dots, e.g. ``"plan.no_features"``.
    what
        One sentence that says what is wrong and where.
    remedy
        One sentence that says what to do.
    """

    def __init__(self, code: str, what: str, remedy: str) -> None:
        super().__init__(f"{what} {remedy}")
        self.code = code
        self.what = what
        self.remedy = remedy

    def __reduce__(self) -> tuple[type[OcmmError], tuple[str, str, str]]:
        return (type(self), (self.code, self.what, self.remedy))


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

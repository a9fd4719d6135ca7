"""Schema of a report in JSON, and its reader."""

from __future__ import annotations

import msgspec

from ocmm_core.errors import InputError

SCHEMA = "ocmm.report/1"

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
Spots = tuple[tuple[tuple[float | None, float | None], ...], ...]


class _Part(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Part of the file."""


class PartVerdictPart(_Part, frozen=True, kw_only=True):
    """The verdict on the part, and its reasons.

    ``word`` leads, with the count of requirements if the plan lacks some; ``requirements`` has the
    count for every plan with a source. ``verdict`` is in the words of the characteristics, null
    without any. ``missing`` names items of the plan that are not measured, features first;
    ``complete`` is true if there are none. ``counts`` has the number of characteristics by verdict.
    """

    word: str
    verdict: str | None
    complete: bool
    not_conform: tuple[str, ...]
    not_proven: tuple[str, ...]
    missing: tuple[str, ...]
    counts: dict[str, int]
    requirements: str = ""


class JobPart(_Part, frozen=True, kw_only=True):
    """Metadata of the job; ``complete`` is that of `PartVerdictPart`."""

    name: str
    uuid: str
    part: str
    serial: str
    operator: str
    order: str
    batch: str
    created_utc: str
    plan: str
    plan_sha256: str
    plan_release: str = ""
    rig_sha256: str
    probe_sha256: str
    measured_with: str
    written_with: str
    complete: bool
    unproven: str
    points_held_back: tuple[int, ...]
    points_taken_back: tuple[int, ...]
    doubts: tuple[str, ...]
    camera_doubts: tuple[str, ...] = ()
    noise: tuple[str, ...] = ()


class SealPart(_Part, frozen=True, kw_only=True):
    """End of the job's chain, and its signature by the station (``ocmm audit verify``).

    ``steps`` and ``head`` are the rows of the audit and the hash of the last one, ``key`` is the
    fingerprint of the signing key, and ``line`` the text of the printed code; both are empty for an
    unsigned job.
    """

    steps: int
    head: str
    key: str
    line: str


class InstrumentPart(_Part, frozen=True, kw_only=True):
    """State and hashes of cameras, probe or reference body."""

    label: str
    note: str


class FramePart(_Part, frozen=True, kw_only=True):
    """Frame of all measured values; world to frame is ``R x + t``."""

    name: str
    rotation_from_world: Matrix
    translation_from_world: Vector


class ElementPart(_Part, frozen=True, kw_only=True):
    """A nominal or actual element, mm and degrees; null for what it lacks."""

    point: Vector
    direction: Vector | None
    across: Vector | None
    diameter: float | None
    length: float | None
    width: float | None
    angle_deg: float | None


class FeaturePart(_Part, frozen=True, kw_only=True):
    """One feature; nominal in the part frame, actual in `FramePart`.

    ``verdict`` is the worst of its characteristics and null without any (or in a file of a version
    without it); ``deciding`` names the deciding one.
    """

    name: str
    shape: str
    verdict: str | None = None
    deciding: str = ""
    points: tuple[int, ...]
    outliers: tuple[int, ...]
    nominal: ElementPart | None
    actual: ElementPart | None
    form: float | None
    rms: float | None
    criterion: str
    note: str


class ExplanationPart(_Part, frozen=True, kw_only=True):
    """Why a result is not CONFORM, and the remedy; ``beyond`` is negative inside the limits."""

    cause: str
    beyond: float | None
    why: str
    suggestion: str
    evidence: str
    features: tuple[str, ...]
    points: tuple[int, ...]


class ResultPart(_Part, frozen=True, kw_only=True):
    """One characteristic; uncertainty is U: value ± U covers the truth in 95 of 100 cases."""

    name: str
    kind: str
    features: tuple[str, ...]
    datums: tuple[str, ...]
    association: str
    frame: str
    rule: str
    unit: str
    nominal: float
    lower: float
    upper: float
    measured: float | None
    deviation: float | None
    uncertainty: float | None
    interval: tuple[float, float] | None
    bonus: float
    floor: float | None
    verdict: str
    note: str
    explanation: ExplanationPart | None = None


class ObservationPart(_Part, frozen=True, kw_only=True):
    """One point as stored: ball centre in the world of the job, and its raw spots, px."""

    number: int
    feature: str
    taken_utc: str
    time_s: float
    first_frame: int
    last_frame: int
    n_frames: int
    tip_world: Vector
    random_covariance: Matrix
    direction_world: Vector
    tip_radius: float
    rotation_world_from_probe: Matrix
    spots: Spots
    reference_spots: Spots | None
    chi2_per_dof: float
    approach: str


class TakenBackPart(_Part, frozen=True, kw_only=True):
    """An annulled point: it does not count, but is kept."""

    observation: ObservationPart
    reason: str


class PaperFactPart(_Part, frozen=True, kw_only=True):
    """A line of the head of the report: heading, clause of ISO/IEC 17025, text."""

    group: str
    clause: str
    name: str
    value: str


class ReportFile(_Part, frozen=True, kw_only=True):
    """The whole file.

    ``state`` has the limitations of the report: SIMULATED, CAMERAS UNPROVEN, INCOMPLETE, IN DOUBT
    or UNCALIBRATED. ``head`` has laboratory, customer, item, measurement and instruments; "not
    stated" if unknown. These, ``part_verdict`` and ``seal`` are missing in files of older versions.
    """

    schema: str
    unit: str
    part_verdict: PartVerdictPart | None = None
    state: tuple[str, ...] = ()
    simulated: bool = False
    job: JobPart
    decision_rule: str
    temperature: str
    reported_at_20_c: bool
    cameras: InstrumentPart
    probe: InstrumentPart
    reference: InstrumentPart
    frame: FramePart
    features: tuple[FeaturePart, ...]
    results: tuple[ResultPart, ...]
    observations: tuple[ObservationPart, ...]
    taken_back: tuple[TakenBackPart, ...]
    seal: SealPart | None = None
    head: tuple[PaperFactPart, ...] = ()


def read_report(content: bytes) -> ReportFile:
    """Return the contents of a file; InputError if it is no report, or of another version."""
    try:
        report = msgspec.json.decode(content, type=ReportFile)
    except (msgspec.MsgspecError, RecursionError) as error:
        raise InputError(
            "report.json", f"Not a job report: {error}.", "Give a file written by ocmm report."
        ) from error
    if report.schema != SCHEMA or report.unit != "mm":
        raise InputError(
            "report.schema",
            f"The report is {report.schema!r} in {report.unit!r}; supported: {SCHEMA!r} in 'mm'.",
            "Read it with the program version that wrote it.",
        )
    return report

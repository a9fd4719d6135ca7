"""Documents of corrections and finished jobs for tests, from numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.tolerances.decisions import Verdict, not_measured
from ocmm_core.tolerances.zones import Characteristic
from ocmm_machine import (
    CorrectionDocument,
    CorrectionLine,
    MeasuredValue,
    PartFacts,
    Proposal,
    load_corrections,
)

NOON = datetime(2026, 11, 20, 12, 0, tzinfo=UTC)
MM = {"present": 0.0, "dead_band": 0.004, "step": 1.0, "lowest": -5000.0, "highest": 5000.0,
      "share": 1.0}  # fmt: skip
DEG = {**MM, "dead_band": 0.002}


def document(
    folder: Path,
    offsets: Sequence[Mapping[str, object]],
    drives: Sequence[Mapping[str, object]],
    frame: Mapping[str, object] | None = None,
    **more: object,
) -> CorrectionDocument:
    """Return a document that was read from its file."""
    return load_corrections(document_file(folder, offsets, drives, frame, **more))


def document_file(
    folder: Path,
    offsets: Sequence[Mapping[str, object]],
    drives: Sequence[Mapping[str, object]],
    frame: Mapping[str, object] | None = None,
    **more: object,
) -> Path:
    straight = {"x": "+X", "y": "+Y", "z": "+Z", "handedness": "right"}
    head = {"schema": "ocmm.corrections/1", "unit": "mm", "machine": "VMC 3", "plan": "QUICK"}
    lines = _fields({**head, **more})
    lines += ["[frame]", *_fields(frame or straight)]
    for one in offsets:
        lines += ["[[offset]]", *_fields({**(DEG if one.get("axis") == "c" else MM), **one})]
    for one in drives:
        lines += ["[[drive]]", *_fields(one)]
    path = folder / "corrections.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _fields(values: Mapping[str, object]) -> list[str]:
    def text(value: object) -> str:
        if isinstance(value, (list, tuple)):
            return f"[{', '.join(map(text, value))}]"
        return repr(value).replace("'", '"')

    return [f"{key} = {text(value)}" for key, value in values.items()]


def measured(
    name: str, kind: str, deviation: float, expanded: float = 0.002, axis: str = "",
    tolerance: float = 50.0, nominal: float = 20.0, feature: str = "",
    verdict: Verdict = Verdict.CONFORM, why: str = "",
) -> MeasuredValue:  # fmt: skip
    """Return a measured characteristic."""
    asked = Characteristic(
        name=name, kind=kind, features=[feature or name], nominal=nominal, lower=-tolerance,
        upper=tolerance,
    )  # fmt: skip
    result = replace(
        not_measured(asked, ""), measured=nominal + deviation, deviation=deviation,
        uncertainty=expanded, verdict=verdict,
    )  # fmt: skip
    return MeasuredValue(result, axis, why)


def part(
    values: Sequence[MeasuredValue], number: int = 1, places: Mapping[str, Float] | None = None,
    created: datetime | None = None,
) -> PartFacts:  # fmt: skip
    """Return the job of a part, one a minute."""
    return PartFacts(
        job=f"job{number}", uuid=f"uuid-{number}", serial=f"S{number}", plan="QUICK",
        created=created or NOON + timedelta(minutes=number), simulated=False, faults=(),
        values={one.result.name: one for one in values}, places=places or {}, aligned=True,
    )  # fmt: skip


def line_of(found: Proposal, utc: datetime, what: str = "corrected") -> CorrectionLine:
    """Return the line of the register for a proposal."""
    return CorrectionLine(
        utc=utc.isoformat(), who="tester", software="", what=what, document="",  # type: ignore[arg-type]
        before={one.offset: one.before for one in found.changes},
        after={one.offset: one.after for one in found.changes},
        job=found.job, serial=found.serial, jobs=found.jobs, serials=found.serials,
        expanded={one.offset: one.expanded for one in found.changed},
    )  # fmt: skip


def all_axes() -> list[Float]:
    """Return the 48 assignments of signed axes, 24 of them left-handed."""
    found = []
    for order in ((0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)):
        for signs in np.ndindex(2, 2, 2):
            axes = np.zeros((3, 3))
            axes[range(3), order] = 1.0 - 2.0 * np.array(signs)
            found.append(axes)
    return found


def frame_of(axes: Float) -> dict[str, str]:
    """Return the frame of a document for axes as rows."""
    names = [("+" if row.sum() > 0 else "-") + "XYZ"[int(np.abs(row).argmax())] for row in axes]
    hand = "right" if np.linalg.det(axes) > 0 else "left"
    return dict(zip("xyz", names, strict=True)) | {"handedness": hand}

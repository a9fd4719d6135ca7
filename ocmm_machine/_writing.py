"""A machine: its document and register; corrections are recorded first, then written, once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import platformdirs

from ocmm_core.build import build_version
from ocmm_core.chain_file import ChainFile
from ocmm_core.documents import digest, write_new
from ocmm_core.errors import InputError, MeasuringError, StorageError
from ocmm_core.seals import Signed
from ocmm_core.storage import JobFile
from ocmm_machine._dialects import correction_file
from ocmm_machine._document import (
    CorrectionDocument,
    CorrectionLine,
    load_corrections,
    read_parts,
    values_in_force,
)
from ocmm_machine._proposal import Proposal, propose

_CORRECTED = "corrected"
"""Event of a job that corrected a machine."""


@dataclass(frozen=True, slots=True)
class Machine:
    """A document of corrections with the register of its machine."""

    document: CorrectionDocument
    digest: str
    """SHA-256 of the document."""
    register: ChainFile[CorrectionLine]
    practice: bool

    @classmethod
    def open(cls, path: Path, folder: Path | None = None, *, practice: bool = False) -> Machine:
        """Return the machine of a document; InputError, or StorageError for an altered register.

        ``folder``: of the registers; None for that of this user. Practice has its own register.
        """
        document = load_corrections(path)
        name = f"{document.machine}{'.practice' if practice else ''}.jsonl"
        folder = folder or platformdirs.user_data_path("ocmm") / "corrections"
        register = ChainFile(
            folder / name, CorrectionLine, signed=Signed.CORRECTIONS, remembered=True
        )
        register.require_signed("Restore the register of corrections from a backup.")
        return cls(document, digest(path), register, practice)

    def preview(
        self, job: Path, *, recut: bool = False, probes: Path | None = None,
        calibrations: Path | None = None,
    ) -> Proposal:  # fmt: skip
        """Return the corrections from a job; errors as of `reopen_job`."""
        lines = self.register.items
        many = self.document.parts > 1 or self.document.dead_parts > 0
        # Parts before an undone correction count again.
        again = not lines or any(line.what == "undone" for line in lines)
        since = datetime.fromtimestamp(0, UTC) if again else datetime.fromisoformat(lines[-1].utc)
        parts, unread = read_parts(job, since if many else None, probes, calibrations)
        return propose(
            self.document, parts, lines, practice=self.practice, recut=recut, unread=unread
        )

    def is_last(self, job_uuid: str) -> bool:
        """Return whether the last line of the register corrected from this job."""
        last = self.register.items[-1:]
        return any(one.what == "corrected" and one.jobs[-1] == job_uuid for one in last)

    def write(
        self, job: Path, proposal: Proposal, code: str, who: str, dialect: str, path: Path,
        now: datetime,
    ) -> CorrectionLine:  # fmt: skip
        """Record a proposal that a person confirmed by its code, also in its job; write its file.

        MeasuringError if it corrects nothing or is not the confirmed one; InputError if the dialect
        cannot carry it, or the file exists; StorageError if the job cannot be written.
        """
        if not proposal.changed:
            raise MeasuringError(
                "correction.nothing",
                f"The job {proposal.job} proves no correction.",
                "See the reasons with: ocmm correct preview.",
            )
        if code != proposal.code:
            raise MeasuringError(
                "correction.confirm",
                "The code does not belong to this correction: job, document or register changed.",
                "Look at the preview again and confirm with its code.",
            )
        line = CorrectionLine(
            utc=now.isoformat(), who=who, software=build_version(), what="corrected",
            document=self.digest, job=proposal.job, serial=proposal.serial, jobs=proposal.jobs,
            serials=proposal.serials,
            characteristics=tuple(
                one.characteristic for one in proposal.effects if one.predicted is not None
            ),
            before={one.offset: one.before for one in proposal.changes},
            after={one.offset: one.after for one in proposal.changes},
            expanded={one.offset: one.expanded for one in proposal.changed},
        )  # fmt: skip
        return self._record(line, dialect, path, job=job)

    def undo(
        self, who: str, reason: str, dialect: str, path: Path, now: datetime
    ) -> CorrectionLine:
        """Undo the last correction, and write the values before it; again if undone already."""
        lines = self.register.items
        if lines and lines[-1].what == "undone":
            return self.write_again(dialect, path)
        if not lines or lines[-1].what != "corrected":
            raise MeasuringError(
                "correction.undo",
                "There is no correction to undo: the last change of an offset was no correction.",
                "State the values of the control instead: ocmm correct set.",
            )
        last = self._last()
        line = CorrectionLine(
            utc=now.isoformat(), who=who, software=build_version(), what="undone",
            document=self.digest, before=last.after, after=last.before,
            undoes=len(lines), reason=reason,
        )  # fmt: skip
        return self._record(line, dialect, path)

    def state(self, given: Mapping[str, float], who: str, now: datetime) -> CorrectionLine:
        """Record values that a person read from the control; InputError if beyond the limits."""
        for name, value in given.items():
            one = self.document.named.get(name)
            steps = value / self.document.resolution
            whole = math.isfinite(steps) and abs(steps - round(steps)) < 1e-4
            if one is None or not whole or not one.lowest <= value <= one.highest:
                raise InputError(
                    "correction.value",
                    f"{name} = {value:g} is no offset of the document, beyond its limits, or has "
                    "more digits than the control.",
                    "Read the control again, or correct the document.",
                )
        before = values_in_force(self.document, self.register.items)
        line = CorrectionLine(
            utc=now.isoformat(), who=who, software=build_version(), what="stated",
            document=self.digest, before=before, after={**before, **given},
        )  # fmt: skip
        self.register.append(line)
        return line

    def write_again(self, dialect: str, path: Path, job: Path | None = None) -> CorrectionLine:
        """Write the file of the last line again; only a job without it gets it recorded."""
        return self._record(self._last(), dialect, path, again=True, job=job)

    def _last(self) -> CorrectionLine:
        """Return the last line; InputError if it is of another document, or of other offsets."""
        line = self.register.items[-1]
        if line.document != self.digest:
            raise InputError(
                "correction.document",
                "The last correction of this machine was recorded with another document.",
                "Give that document, as it was then.",
            )
        return line

    def _record(
        self, line: CorrectionLine, dialect: str, path: Path, *, again: bool = False,
        job: Path | None = None,
    ) -> CorrectionLine:  # fmt: skip
        """Check everything, record the line, then write its file."""
        content = correction_file(self.document, line, dialect, practice=self.practice)
        if path.exists() or not path.parent.is_dir():
            raise InputError(
                "correction.file", f"{path} exists, or its folder is missing.", "Change --out."
            )
        # A job that another program holds, or that is write-protected, is refused first.
        with nullcontext() if job is None or self.practice else JobFile.open(job) as opened:
            if not again:
                self.register.append(line)
            if opened is not None:
                _state_in(opened, self.document.machine, line)
        try:
            write_new(path, content)
        except OSError as error:
            raise StorageError(
                "correction.file",
                f"{path}: the correction is recorded, but this file cannot be written "
                f"({error.strerror}).",
                "Give the command again with another --out: it writes the same values.",
            ) from error
        return line


def _state_in(job: JobFile, machine: str, line: CorrectionLine) -> None:
    """Add a correction to the signed events of its job, once."""
    changes = ", ".join(f"{one} {line.before[one]!r} → {line.after[one]!r}" for one in line.changed)
    text = f"{machine}, {line.utc[:19]} UTC, by {line.who}: {changes}"
    if not any((one.kind, one.text) == (_CORRECTED, text) for one in job.events()):
        job.append_event(_CORRECTED, text)

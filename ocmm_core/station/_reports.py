"""Reports of the current job of a station."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ocmm_core.errors import MeasuringError
from ocmm_core.export import DEFAULT_FORMAT, write_report
from ocmm_core.export.report import Instrument, Profile, ReportData, report_data
from ocmm_core.export.template import paper_of
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.named_file import FileIdentity
from ocmm_core.station._instruments import Instruments
from ocmm_core.station._open_job import CurrentJob, OpenJob

_TRIES = 20


class Reports:
    def __init__(self, current: CurrentJob, instruments: Instruments) -> None:
        self._current, self._instruments = current, instruments

    def data(self) -> ReportData:
        """Return the report data of the current job.

        Takes up to some seconds: not for the thread of a window. MeasuringError: the job changes
        faster than it can be reported. OcmmError: the job file cannot be read, or lost its name.
        """
        for _ in range(_TRIES):
            job = self._current.now
            job.file.require_name()
            view = job.session.view
            found = self._data_of(job, view)
            # A concurrent point would be in one half of the report only.
            if job.session.view is view and job is self._current.now:
                return found
        raise MeasuringError(
            "export.busy",
            "The job is changing too fast to be reported.",
            "Pause it, or write the report when probing is slower.",
        )

    def export(
        self,
        directory: Path,
        formats: Sequence[str] = (DEFAULT_FORMAT,),
        profile: Profile | None = None,
        *,
        incomplete: bool = False,
    ) -> tuple[Path, ...]:
        """Write reports on the sheet of this station; as `write_report`, InputError: template."""
        data = replace(self.data(), paper=paper_of(self._current.now.file.path))
        files = write_report(data, formats, directory, profile, incomplete=incomplete)
        written = tuple(map(FileIdentity.of_written, files))
        lost = self._current.now.file.check_name()
        if lost is not None:
            for file in written:
                file.remove()
            raise lost
        return files

    def _data_of(self, job: OpenJob, view: JobView) -> ReportData:
        instruments = self._instruments
        calibration, probe = instruments.calibration(), instruments.probe()
        reference = instruments.reference
        back = tuple(job.file.annulled())
        return report_data(
            view,
            job.file.head,
            job.use.plan,
            T_part_from_world=job.session.frame.T_part_from_world,
            calibration=Instrument(
                calibration.label, f"{calibration.word.value} {calibration.identity}"
            ),
            probe=Instrument(probe.label, probe.note),
            reference=Instrument(
                "" if reference is None else reference.label,
                "" if reference is None else f"{reference.name} {reference.identity}",
            ),
            climate=job.use.options.climate,
            observations=tuple(job.file.points()),
            annulled=tuple(point.number for point, _ in back),
            taken_utc=job.file.taken_utc(),
            taken_back=back,
            explained=job.session.explanations(),
            seal=job.file.seal(),
            release=job.release,
        )

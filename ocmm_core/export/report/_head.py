"""Head of a report: the verdict on the part first, then identification of the job."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ocmm_core.export.report._names import check_name, clean_text
from ocmm_core.export.report._report_data import ReportData
from ocmm_core.export.report._tables import ReportTable
from ocmm_core.tolerances.decisions import U_WORDS, Verdict

_RESULT = "characteristic"
_LONGEST_LIST = 200
"""Characters of names in one cell; free text is cut at 250, and no name may be lost."""


def head_table(data: ReportData) -> ReportTable:
    """Return the summary of the job, as pairs of word and text."""
    view, head = data.view, data.head
    counts = dict.fromkeys(Verdict, 0)
    for result in data.results:
        counts[result.verdict] += 1
    part = data.part
    pairs: list[tuple[str, str | int]] = [
        ("Part verdict", part.headline),
        ("Job state", data.state_words),
        *((("Requirements", part.requirement_words),) if part.requirement_words else ()),
        *_named("Characteristics NOT CONFORM", _RESULT, part.failing),
        *_named("Characteristics NOT PROVEN", _RESULT, part.unproven),
        *_named("Features INCOMPLETE", "feature", part.missing_features),
        *_named("Characteristics NOT MEASURED", _RESULT, part.unmeasured),
        ("Job", data.job),
        ("Job identity", head.job_uuid),
        ("Part", clean_text(view.part)),
        ("Serial number", clean_text(head.serial)),
        ("Operator", clean_text(head.operator)),
        ("Order", clean_text(view.header.order)),
        ("Batch", clean_text(view.header.batch)),
        ("Begun (UTC)", head.created_utc),
        ("Last point (UTC)", data.last_taken_utc),
        ("Plan", data.plan.name),
        ("Plan SHA-256", head.plan_identity),
        ("Plan release", clean_text(data.release.words)),
        *((verdict.value, count) for verdict, count in counts.items()),
        ("Decision rule", data.rule_words),
        ("Uncertainty", U_WORDS),
        ("Frame", data.system),
        ("Complete", "yes" if part.complete else "no"),
        ("Not proven because", clean_text(view.unproven)),
        ("Points held back", ", ".join(map(str, view.held))),
        ("Points taken back", ", ".join(map(str, data.annulled))),
        ("Cameras", clean_text(data.calibration.note or data.calibration.label)),
        ("Probe", clean_text(data.probe.note or data.probe.label)),
        ("Reference body", clean_text(data.reference.label)),
        ("Temperatures", clean_text(view.temperature)),
        ("Reported at 20 C", "yes" if view.at_20_c else "no"),
        ("Measured with", f"OCMM {head.software_version}"),
        ("Reported with", f"OCMM {data.written_by}"),
        *_numbered("Cameras", view.camera_doubts),
        *_numbered("Noise", view.noise),
        *_numbered("Doubt", data.notes),
    ]
    return ReportTable("Job", ("Item", "Value"), tuple(pairs))


def _numbered(title: str, sentences: Sequence[str]) -> Iterator[tuple[str, str]]:
    for index, sentence in enumerate(sentences, start=1):
        yield f"{title} {index}", clean_text(sentence)


def _named(title: str, kind: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield names under a title, on as many lines as needed."""
    lines: list[str] = []
    for name in names:
        checked = check_name(kind, name)
        if lines and len(lines[-1]) + len(checked) < _LONGEST_LIST:
            lines[-1] += f", {checked}"
        else:
            lines.append(checked)
    for number, line in enumerate(lines, start=1):
        yield (title if number == 1 else f"{title} {number}", line)

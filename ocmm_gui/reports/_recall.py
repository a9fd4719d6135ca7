"""The pages of a recall as PDF.

``python -m ocmm_gui.reports._recall RECALL.json FILE.pdf --language de``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ocmm_core.calibration.records import load, record_hash, seal
from ocmm_core.export import write_together
from ocmm_core.inspection import recall
from ocmm_core.inspection.evaluation import NO_REAL_PART, SIMULATED
from ocmm_core.inspection.finished import Outcome, RecallRecord
from ocmm_core.wording import ENGLISH, LANGUAGES, Speech
from ocmm_gui.reports._canvas import (
    BODY,
    HEADING,
    INK,
    SMALL,
    STRONG,
    TITLE,
    Column,
    PageCanvas,
    PageField,
    Style,
    draw,
)
from ocmm_gui.reports._paper import paint_with_foot, written_pdf

_WIDTHS = (340.0, 390.0, 390.0, 230.0, 450.0)
_COLOURS = {Outcome.HOLDS: INK.good, Outcome.CHANGES: INK.bad, Outcome.UNKNOWN: INK.warn}


def lay_out(record: RecallRecord, language: str = ENGLISH) -> PageCanvas:
    """Return the pages: totals first, then jobs in order of urgency."""
    canvas = PageCanvas(Speech(language))
    text = canvas.speech.text
    canvas.text(canvas.speech.word("Recall"), TITLE)
    canvas.text(recall.headline(record, canvas.speech), HEADING)
    for sentence in (*recall.totals(record), recall.decided(record)) if record.jobs else ():
        canvas.write_sentence(sentence)
    made = f"{record.made_utc[:16].replace('T', ' ')} UTC, OCMM {record.software}."
    canvas.text(f"{text(recall.checked(record))} {made}", SMALL)
    for sentence in recall.not_judged(record):
        canvas.write_sentence(sentence, Style(colour=INK.warn))
    columns = [Column(name, w) for name, w in zip(recall.COLUMNS[1:], _WIDTHS, strict=True)]
    for job in recall.worst_first(record.jobs):
        canvas.skip(24.0)
        canvas.room(260.0)
        canvas.text(recall.job_line(job, canvas.speech), STRONG)
        canvas.write_sentence(recall.rests_on(job), SMALL)
        canvas.table(
            columns,
            [
                [
                    PageField(text, Style(24.0, bold=True, colour=_COLOURS[one.outcome]))
                    if text == canvas.speech.word(one.outcome.value)
                    else PageField(text, Style(24.0, colour=BODY.colour))
                    for text in recall.row(one, canvas.speech)
                ]
                for one in job.characteristics
            ],
        )
    return canvas


def pdf_bytes(record: RecallRecord, language: str = ENGLISH) -> bytes:
    """Return the recall as a PDF file with the sealed record inside.

    Raises StorageError if the file read back differs from the input.
    """
    canvas = lay_out(record, language)
    last = canvas.speech.text(foot(record))
    return written_pdf(
        canvas,
        lambda painter, index: paint_with_foot(painter, canvas, index, last),
        {"recall.json": seal(record)},
        title=canvas.speech.text(f"Recall {record.made_utc[:10]}"),
        software=record.software,
        utc=record.made_utc,
    )


def foot(record: RecallRecord) -> str:
    """Return the foot of every page: the recall's identity, and SIMULATED if applicable."""
    named = f"Recall SHA-256 {record_hash(record)}"
    simulated = sum(job.simulated for job in record.jobs)
    if not simulated:
        return named
    whose = f"{simulated} of {len(record.jobs)} jobs."
    origin = NO_REAL_PART if simulated == len(record.jobs) else whose
    return f"{SIMULATED}: {origin}   {named}"


def main(arguments: list[str] | None = None) -> int:
    """Write the pages; return 0, 2 on failure, 3 after an unexpected error."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recall", type=Path)
    parser.add_argument("pdf", type=Path)
    parser.add_argument("--language", choices=LANGUAGES, default=ENGLISH)
    options = parser.parse_args(arguments)

    def write() -> None:
        record = load(options.recall, RecallRecord)
        write_together({options.pdf: pdf_bytes(record, options.language)})

    return draw(write, "The pages of the recall", "The decision is stored.")


if __name__ == "__main__":
    sys.exit(main())

"""The sheet of a planned rig: ``python -m ocmm_gui.reports._rig_sheet RIG.json FILE.pdf``."""

from __future__ import annotations

import argparse
import sys
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from ocmm_core.export import write_together
from ocmm_core.wording import ENGLISH, LANGUAGES, Speech
from ocmm_gui.reports._canvas import (
    HEADING,
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
from ocmm_planner import RigSheet, read_sheet, sheet_sentences, shopping_list

_NAMES = ("X", "Y", "Z", "Azimuth °", "Elevation °", "Roll °", "Focus", "Stop", "Exposure / µs")
_LENGTHS = ("X", "Y", "Z", "Focus")
_CELL = Style(24.0)


def lay_out(sheet: RigSheet, language: str = ENGLISH) -> PageCanvas:
    """Return the pages: U first, then places, and what to buy."""
    canvas = PageCanvas(Speech(language))
    number = canvas.speech.number
    canvas.text(canvas.speech.word("Planned rig"), TITLE)
    canvas.text(f"{sheet.plan}: {sheet.probe}", HEADING)
    canvas.text(sheet.frame, SMALL)
    for sentence in sheet_sentences(sheet):
        canvas.write_sentence(sentence)
    canvas.heading("Places of the cameras", 200.0)
    columns = [Column(name, 175.0, right=True, length=name in _LENGTHS) for name in _NAMES]
    rows = []
    for one in sheet.cameras:
        values = (*one.centre, one.azimuth_deg, one.elevation_deg, one.roll_deg, one.focus)
        exposure = "-" if one.exposure_us is None else f"{one.exposure_us:.1f}"
        texts = [*(f"{value:.1f}" for value in values), f"{one.stop:g}", exposure]
        cells = [PageField(number(text), _CELL) for text in texts]
        rows.append([PageField(one.name, STRONG), *cells])
    canvas.table([Column("Camera", 225.0), *columns], rows)
    canvas.write_sentence(
        "X, Y, Z: projection centre. Azimuth from +Y towards +X, elevation upwards.", SMALL
    )
    canvas.heading("What to buy", 100.0)
    for item in shopping_list(sheet):
        canvas.text(item)
    return canvas


def rig_sheet_pdf(sheet: RigSheet, language: str = ENGLISH) -> bytes:
    """Return the sheet as a PDF file with its JSON inside; StorageError as `written_pdf`."""
    canvas = lay_out(sheet, language)
    foot = "   ".join((sheet.plan, sheet.plan_identity[:16], f"OCMM {sheet.software}"))
    return written_pdf(
        canvas,
        lambda painter, index: paint_with_foot(painter, canvas, index, foot),
        {"rig.json": msgspec.json.encode(sheet)},
        title=f"{canvas.speech.word('Planned rig')}: {sheet.plan}",
        software=sheet.software,
        utc=datetime.now(UTC).isoformat(),
    )


def main(arguments: list[str] | None = None) -> int:
    """Write the sheet; return 0, 2 on failure, 3 after an unexpected error."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sheet", type=Path)
    parser.add_argument("pdf", type=Path)
    parser.add_argument("--language", choices=LANGUAGES, default=ENGLISH)
    options = parser.parse_args(arguments)

    def write() -> None:
        write_together({options.pdf: rig_sheet_pdf(read_sheet(options.sheet), options.language)})

    return draw(write, "The sheet of the rig", "The prediction is unchanged.")


if __name__ == "__main__":
    sys.exit(main())

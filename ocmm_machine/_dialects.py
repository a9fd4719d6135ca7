"""Files of corrections for controls; values are absolute, so that loading one twice is harmless.

Only forms that vendors document in public are written (docs/integrator/machine.md). Numbers have
the decimals of the resolution and always a point; text is ASCII.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

from lxml import etree

from ocmm_core.errors import InputError
from ocmm_core.export.report import spreadsheet_text
from ocmm_machine._document import ControlOffset, CorrectionDocument, CorrectionLine

_CHECK = "CHECK: the control must show the old values before this is loaded"
_PRACTICE = "PRACTICE - SIMULATED - NOT FOR A MACHINE"
_MTCONNECT = "urn:mtconnect.org:MTConnectAssets:1.3"
_XYZ = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class _Form:
    """Lines of a control: by offset, with {n} for its number and {v} for its value."""

    lines: dict[str, str]
    work_offsets: int
    comment: str = "({})"
    end: str = "M30"


_FORMS = {
    "linuxcnc": _Form(
        {
            **{f"work {one}": f"G21 G90 G10 L2 P{{n}} {one.upper()}{{v}}" for one in _XYZ},
            "work c": "G21 G90 G10 L2 P{n} R{v}",
            "length geometry": "G21 G90 G10 L1 P{n} Z{v}",
            "radius geometry": "G21 G90 G10 L1 P{n} R{v}",
        },
        9, end="M2",
    ),
    "fanuc": _Form(
        {
            **{f"work {one}": f"G90 G10 L2 P{{n}} {one.upper()}{{v}}" for one in _XYZ},
            **{f"more {one}": f"G90 G10 L20 P{{n}} {one.upper()}{{v}}" for one in _XYZ},
            "length geometry": "G90 G10 L10 P{n} R{v}", "length wear": "G90 G10 L11 P{n} R{v}",
            "radius geometry": "G90 G10 L12 P{n} R{v}", "radius wear": "G90 G10 L13 P{n} R{v}",
            "diameter geometry": "G90 G10 L12 P{n} R{v}", "diameter wear": "G90 G10 L13 P{n} R{v}",
            "turn-x wear": "G10 P{n} X{v}", "turn-z wear": "G10 P{n} Z{v}",
            "turn-x geometry": "G10 P1{n:04d} X{v}", "turn-z geometry": "G10 P1{n:04d} Z{v}",
        },
        54,
    ),
    "siemens": _Form(
        {
            # A correction belongs into the fine part; a rotation has none.
            **{f"work {one}": f"$P_UIFR[{{n}},{one.upper()},FI]={{v}}" for one in _XYZ},
            "work c": "$P_UIFR[{n},Z,RT]={v}",
            "length geometry": "$TC_DP3[{n},1]={v}", "length wear": "$TC_DP12[{n},1]={v}",
            "radius geometry": "$TC_DP6[{n},1]={v}", "radius wear": "$TC_DP15[{n},1]={v}",
        },
        99, comment="; {}",
    ),
    # Columns of the table of tools; the sign of the preset table differs between controls.
    "heidenhain": _Form(
        {"length geometry": "L", "radius geometry": "R", "length wear": "DL", "radius wear": "DR"},
        0, comment="; {}",
    ),
    # A measured dimension of a tool, its code (ISO 13399), and how often it has the offset.
    "mtconnect": _Form(
        {
            "length geometry": "FunctionalLength LF 1",
            "radius geometry": "CuttingDiameterMax DC 2",
            "diameter geometry": "CuttingDiameterMax DC 1",
        },
        0, comment="{}",
    ),
}  # fmt: skip
_FIRST_MORE = 6
"""Work offsets of Fanuc above G59 are G54.1 P1 on."""
DIALECTS = (*_FORMS, "csv")
CSV_COLUMNS = ("Machine", "Offset", "Kind", "Number", "Axis", "Register", "Unit", "Old", "New",
               "U", "Job", "Serial", "Utc", "By", "State")  # fmt: skip


def correction_file(
    document: CorrectionDocument, line: CorrectionLine, dialect: str, *, practice: bool
) -> bytes:
    """Return the file of a line of the register: the changed offsets alone.

    Practice files contain comments only. InputError if the dialect is unknown or cannot carry one.
    """
    decimals = max(0, math.ceil(-math.log10(document.resolution) - 1e-9))
    moved = [one for one in document.offset if one.name in line.changed]
    texts = {one.name: f"{line.after[one.name]:.{decimals}f}" for one in moved}
    if dialect == "csv":
        return _csv(document, moved, texts, line, practice=practice)
    if dialect not in _FORMS:
        known = ", ".join(DIALECTS)
        raise InputError(
            "correction.dialect", f"Dialect '{dialect}' is not known.", f"Give one of: {known}."
        )
    form = _FORMS[dialect]
    comments = [
        f"OCMM corrections of {document.machine}, {line.utc[:19]} UTC, by {line.who}",
        f"{line.what}, job {line.job}, serial {line.serial}", _CHECK,
        *(f"{one.name}: old {line.before[one.name]:.{decimals}f} new {texts[one.name]} "
          f"U {line.expanded.get(one.name, math.nan):.4f}" for one in moved),
    ]  # fmt: skip
    found = [(one, *_line_of(form, one, dialect)) for one in moved]
    if dialect == "mtconnect":
        measured = [
            (one.number, size, code, f"{int(times) * line.after[one.name]:.{decimals}f}")
            for one, name, _ in found
            for size, code, times in [name.split()]
        ]
        comments = [_comment(form, one) for one in (*[_PRACTICE] * practice, *comments)]
        return _assets(document.machine, line.utc, comments, measured, practice=practice)
    if dialect == "heidenhain":
        lines = _table([(one.number, name, texts[one.name]) for one, name, _ in found])
    else:
        lines = [text.format(n=n, v=texts[one.name]) for one, text, n in found] + [form.end]
    if practice:
        comments = [_PRACTICE, *comments, *lines]
        lines = []
    elif dialect == "heidenhain":
        comments = []  # a table has none
    return "\n".join([*(_comment(form, one) for one in comments), *lines, ""]).encode("ascii")


def _line_of(form: _Form, offset: ControlOffset, dialect: str) -> tuple[str, int]:
    """Return the line of an offset, and the number in it."""
    number, kind = offset.number, f"{offset.kind} {offset.axis or offset.register}"
    if offset.kind == "radius" and offset.counts == "diameter":
        kind = f"diameter {offset.register}"
    beyond = offset.kind == "work" and number > form.work_offsets
    if kind.startswith("work") and f"more {offset.axis}" in form.lines and number > _FIRST_MORE:
        kind, number = f"more {offset.axis}", number - _FIRST_MORE
    if beyond or kind not in form.lines:
        raise InputError(
            "correction.dialect",
            f"No public form of {dialect} carries the offset '{offset.name}'.",
            "Give --dialect csv and enter the value by hand, or change the document.",
        )
    return form.lines[kind], number


def _table(cells: Sequence[tuple[int, str, str]]) -> list[str]:
    """Return a table of tools with the columns that occur."""
    names = list(dict.fromkeys(name for _, name, _ in cells))
    values = {(tool, name): text if text[0] == "-" else f"+{text}" for tool, name, text in cells}
    rows = [
        f"{tool:<8}" + "".join(f"{values.get((tool, name), ''):<12}" for name in names)
        for tool in sorted({tool for tool, _, _ in cells})
    ]
    heads = "T       " + "".join(f"{name:<12}" for name in names)
    return ["BEGIN OCMM.T MM", heads, *rows, "[END]"]


def _assets(
    machine: str, utc: str, comments: Sequence[str],
    measured: Sequence[tuple[int, str, str, str]], *, practice: bool,
) -> bytes:  # fmt: skip
    """Return measured tools as assets (MTConnectAssets_1.3.xsd); practice leaves them empty."""

    def child(parent: etree._Element, name: str, text: str = "", **stated: str) -> etree._Element:
        found = etree.SubElement(parent, f"{{{_MTCONNECT}}}{name}", stated)
        found.text = text or None
        return found

    tools = sorted({tool for tool, *_ in measured})
    root = etree.Element(f"{{{_MTCONNECT}}}MTConnectAssets", nsmap={"m": _MTCONNECT})
    count = str(len(tools))
    child(
        root, "Header", version="1.3", creationTime=utc, instanceId="1", sender="OCMM",
        assetBufferSize=count, assetCount=count,
    )  # fmt: skip
    assets = child(root, "Assets")
    for tool in tools:
        name = f"T{tool}"
        asset = child(
            assets, "CuttingTool", assetId=f"{machine}.{name}", timestamp=utc, serialNumber=name,
            toolId=name,
        )  # fmt: skip
        child(asset, "Description", "; ".join(comments))
        cycle = child(asset, "CuttingToolLifeCycle")
        child(child(cycle, "CutterStatus"), "Status", "MEASURED")
        child(cycle, "ProgramToolNumber", str(tool))
        sizes = child(cycle, "Measurements")
        for number, size, code, text in measured:
            if number == tool:
                child(sizes, size, "" if practice else text, code=code, units="MILLIMETER")
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _comment(form: _Form, text: str) -> str:
    plain = "".join(c if c.isascii() and c.isprintable() and c not in "()" else "-" for c in text)
    return form.comment.format(plain)


def _csv(
    document: CorrectionDocument, moved: Sequence[ControlOffset], texts: dict[str, str],
    line: CorrectionLine, *, practice: bool,
) -> bytes:  # fmt: skip
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, lineterminator="\r\n")
    writer.writerow(CSV_COLUMNS)
    for one in moved:
        names = map(spreadsheet_text, (document.machine, one.name))
        source = map(spreadsheet_text, (line.job, line.serial, line.utc, line.who))
        # Practice leaves the column empty that a program would read.
        writer.writerow(
            [*names, one.kind, one.number, one.axis, one.register, one.unit, line.before[one.name],
             "" if practice else texts[one.name], line.expanded.get(one.name, ""), *source,
             _PRACTICE if practice else "CHECK"]
        )  # fmt: skip
    return stream.getvalue().encode("utf-8-sig")

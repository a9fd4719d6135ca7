"""Drawn pages as PDF/A-3a (ISO 19005-3): tags, metadata, output intent and associated files.

Qt draws the pages and embeds the fonts. It knows no tags, so each tagged drawing is enclosed by two
lines off the page (`paint_tag`), which become marked content here.
"""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from html import escape
from typing import IO, cast

from pypdf import PageObject, PdfReader, PdfWriter
from pypdf.errors import PyPdfError
from pypdf.generic import (
    ArrayObject,
    BooleanObject,
    ByteStringObject,
    DecodedStreamObject,
    DictionaryObject,
    IndirectObject,
    NameObject,
    NumberObject,
    PdfObject,
    StreamObject,
    TextStringObject,
)
from PySide6.QtCore import QPointF
from PySide6.QtGui import QColor, QColorSpace, QPainter, QPdfWriter, QPen

from ocmm_core.documents import read_text, resource

_OFF = -9000
"""Position of the marks, tenths of a millimetre: far off the page."""
_LEVEL = 3
"""Of compression: half the time of the usual one, for a file larger by some percent."""
_MARKING = QPen(QColor("black"), 2.0)
"""Not the default pen, which Qt strokes as an area."""
_MARK = re.compile(rb"-9000 -(\d+) m\n-9000 -\d+ l\nS\n")
_RANGE = re.compile(rb"^(<\w{4}> <\w{4}> )(.*)$", re.MULTILINE)
"""Of a font's codes, and the characters that they are copied as."""
_TYPES = {".json": "application/json", ".xml": "text/xml", ".csv": "text/csv"}


@dataclass(frozen=True, slots=True)
class PageTag:
    """An element of the structure of a document (ISO 32000-1, 14.8.4)."""

    role: str
    parent: int = -1
    """Index of the enclosing element; -1 for the document."""
    words: str = ""
    """Alternative text of a figure."""


@dataclass(frozen=True, slots=True)
class PdfFacts:
    title: str
    language: str
    software: str
    utc: str
    """Time of the record, ISO 8601: the same record makes the same file."""


def paint_tag(painter: QPainter, number: int) -> None:
    """Start the element of an index in a PDF; -1 ends it. Nothing on a screen."""
    if isinstance(painter.device(), QPdfWriter):
        painter.save()
        painter.setClipping(False)
        painter.setPen(_MARKING)
        painter.drawLine(QPointF(_OFF, -number - 2), QPointF(_OFF, -number - 3))
        painter.restore()


def archival_pdf(
    drawn: bytes, tags: Sequence[PageTag], facts: PdfFacts, files: Mapping[str, bytes]
) -> bytes:
    """Return pages as PDF/A-3a with associated files: ``.json``, ``.xml`` or ``.csv`` by name."""
    writer = PdfWriter(clone_from=io.BytesIO(drawn))
    writer.pdf_header = "%PDF-1.7"
    root, moment = writer.root_object, datetime.fromisoformat(facts.utc)
    moment = moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)
    creator, stamp = f"OCMM {facts.software}", moment.strftime("D:%Y%m%d%H%M%SZ")
    xmp = read_text(resource("reports", "archival.xmp")).format(
        title=escape(facts.title), language=facts.language, creator=escape(creator),
        utc=moment.strftime("%Y-%m-%dT%H:%M:%SZ"),
    ).encode()  # fmt: skip
    for page in writer.pages:
        _clean_fonts(page)
    # Qt's metadata contain the time of writing.
    cast("StreamObject", root["/Metadata"].get_object()).set_data(xmp)
    root[_n("Lang")] = TextStringObject(facts.language)
    root[_n("MarkInfo")] = _dict(Marked=BooleanObject(value=True))
    root[_n("ViewerPreferences")] = _dict(DisplayDocTitle=BooleanObject(value=True))
    root[_n("OutputIntents")] = ArrayObject([_add(writer, _intent(writer))])
    root[_n("StructTreeRoot")] = _structure(writer, tags)
    specs = [_add(writer, _file(writer, name, files[name], stamp)) for name in sorted(files)]
    if specs:
        root[_n("AF")] = ArrayObject(specs)
        names = [part for name, spec in zip(sorted(files), specs, strict=True)
                 for part in (TextStringObject(name), spec)]  # fmt: skip
        root[_n("Names")] = _dict(EmbeddedFiles=_dict(Names=ArrayObject(names)))
    writer.metadata = None
    writer.add_metadata({
        "/Title": facts.title, "/Creator": creator, "/Producer": creator, "/CreationDate": stamp,
        "/ModDate": stamp,
    })  # fmt: skip
    digest = hashlib.sha256(b"".join((xmp, *files.values()))).digest()[:16]
    writer._ID = ArrayObject([ByteStringObject(digest)] * 2)  # noqa: SLF001 - else random
    out = io.BytesIO()
    writer.write(out)
    return out.getvalue()


def attached(pdf: bytes) -> tuple[int, dict[str, bytes]]:
    """Return the number of pages and the associated files; ValueError if unreadable."""
    try:
        reader = PdfReader(io.BytesIO(pdf), strict=True)
        return len(reader.pages), {name: one[0] for name, one in reader.attachments.items()}
    except (PyPdfError, KeyError, TypeError) as error:
        raise ValueError(str(error)) from error


class _Written(PdfObject):
    """An object in its bytes: pypdf takes seconds for dictionaries of thousands of elements."""

    content = b""

    def write_to_stream(self, stream: IO[bytes], encryption_key: str | bytes | None = None) -> None:
        """Write the bytes."""
        stream.write(self.content)


def _structure(writer: PdfWriter, tags: Sequence[PageTag]) -> IndirectObject:
    """Turn the marks into marked content and return the tree of the elements."""
    tree, document, places = _dict(Type=_n("StructTreeRoot")), _Written(), _Written()
    root, top = _add(writer, tree), _add(writer, document)
    elements = [_Written() for _ in tags]
    nodes = [_place(_add(writer, element)) for element in elements]
    # The last are those of the document.
    kids: list[list[str]] = [[] for _ in (*tags, document)]
    for tag, node in zip(tags, nodes, strict=True):
        kids[tag.parent].append(node)
    numbers = []
    for number, page in enumerate(writer.pages):
        drawn, place = page.get_contents(), page.indirect_reference
        found, content = _marked(b"" if drawn is None else drawn.get_data(), tags)
        for mark, index in enumerate(found):
            kids[index].append(f"<</Type/MCR/Pg {_place(place)}/MCID {mark}>>")
        page[_n("Contents")] = _add(writer, _stream(content).flate_encode(_LEVEL))
        page[_n("StructParents")] = NumberObject(number)
        page[_n("Tabs")] = _n("S")
        numbers.append(f"{number}[{' '.join(nodes[index] for index in found)}]")
    for element, tag, own in zip(elements, tags, kids[:-1], strict=True):
        parent = _place(top) if tag.parent < 0 else nodes[tag.parent]
        more = "/A<</O/Table/Scope/Column>>" if tag.role == "TH" else ""
        element.content = (
            f"<</Type/StructElem/S/{tag.role}/P {parent}/K[{' '.join(own)}]{more}".encode()
            + _alternative(tag.words)
        )
    document.content = (
        f"<</Type/StructElem/S/Document/P {_place(root)}/K[{' '.join(kids[-1])}]>>".encode()
    )
    places.content = f"<</Nums[{' '.join(numbers)}]>>".encode()
    after = NumberObject(len(writer.pages))
    tree.update(_dict(K=top, ParentTree=_add(writer, places), ParentTreeNextKey=after))
    return root


def _place(reference: IndirectObject | None) -> str:
    return "null" if reference is None else f"{reference.idnum} {reference.generation} R"


def _alternative(words: str) -> bytes:
    """Return the end of an element, with an alternative text if it has one."""
    out = io.BytesIO()
    if words:
        out.write(b"/Alt ")
        TextStringObject(words).write_to_stream(out)
    return out.getvalue() + b">>"


def _marked(content: bytes, tags: Sequence[PageTag]) -> tuple[list[int], bytes]:
    """Return the elements on a page in order, and its marked content; all else is an artifact."""
    found: list[int] = []

    def change(match: re.Match[bytes]) -> bytes:
        index = int(match[1]) - 2
        if index < 0:
            return b"EMC\n/Artifact BMC\n"
        found.append(index)
        return f"EMC\n/{tags[index].role} <</MCID {len(found) - 1}>> BDC\n".encode()

    return found, b"/Artifact BMC\n" + _MARK.sub(change, content) + b"EMC\n"


def _clean_fonts(page: PageObject) -> None:
    """Correct Qt's fonts: spaces copied as tabs, incomplete lists of characters."""
    for font in cast("DictionaryObject", page["/Resources"]).get("/Font", {}).values():
        for under in font.get("/DescendantFonts", ()):
            # Optional in PDF/A-3 (6.2.11.4.2).
            under["/FontDescriptor"].pop("/CIDSet", None)
        stream = font["/ToUnicode"]
        stream.set_data(_RANGE.sub(_with_spaces, stream.get_data()))


def _with_spaces(match: re.Match[bytes]) -> bytes:
    return match[1] + match[2].replace(b"<0009>", b"<0020>")


def _intent(writer: PdfWriter) -> DictionaryObject:
    profile = bytes(QColorSpace(QColorSpace.NamedColorSpace.SRgb).iccProfile().data())
    stream = _add(writer, _stream(profile, N=NumberObject(3)).flate_encode())
    return _dict(
        Type=_n("OutputIntent"), S=_n("GTS_PDFA1"), DestOutputProfile=stream,
        OutputConditionIdentifier=TextStringObject("sRGB IEC61966-2.1"),
        Info=TextStringObject("sRGB IEC61966-2.1"),
    )  # fmt: skip


def _file(writer: PdfWriter, name: str, content: bytes, stamp: str) -> DictionaryObject:
    kind = _n(_TYPES[name[name.rindex(".") :]])
    times = _dict(ModDate=TextStringObject(stamp), Size=NumberObject(len(content)))
    stream = _add(writer, _stream(content, Type=_n("EmbeddedFile"), Subtype=kind, Params=times)
                  .flate_encode(_LEVEL))  # fmt: skip
    return _dict(
        Type=_n("Filespec"), F=TextStringObject(name), UF=TextStringObject(name),
        EF=_dict(F=stream, UF=stream), AFRelationship=_n("Data"),
    )  # fmt: skip


def _add(writer: PdfWriter, one: PdfObject) -> IndirectObject:
    return writer._add_object(one)  # noqa: SLF001 - pypdf has no other way


def _n(name: str) -> NameObject:
    return NameObject(f"/{name}")


def _dict(**entries: PdfObject) -> DictionaryObject:
    return DictionaryObject({_n(name): entry for name, entry in entries.items()})


def _stream(content: bytes, **entries: PdfObject) -> DecodedStreamObject:
    stream = DecodedStreamObject()
    stream.set_data(content)
    stream.update(_dict(**entries))
    return stream

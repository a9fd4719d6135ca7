"""Reader of Digital Calibration Certificates from any source, bounded and offline.

Certificates are untrusted: no document type, no entity, no other file, no network, at most
`LARGEST` bytes, `_DEEPEST` levels and `_MOST` quantities. Numbers must be finite.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass

from lxml import etree

from ocmm_core.documents import untrusted_xml
from ocmm_core.errors import InputError
from ocmm_core.export.certificate._dcc import DCC, SI
from ocmm_core.export.certificate._xml_signature import TrustedSigners, XmlSignature, xml_signature

LARGEST = 20_000_000
_DEEPEST = 64
_MOST = 20_000
_VERSIONS = ("3.",)
_LONGEST_NAME = 400
_NO_ELEMENTS: tuple[object, ...] = (etree.Comment, etree.ProcessingInstruction)
_UNCERTAINTY = (("uncertainty", "valueExpandedMU"), ("coverageFactor",))
"""Elements of expanded uncertainty and k in D-SI 1 and 2.1, and in D-SI 2.2 and later."""


@dataclass(frozen=True, slots=True)
class DccQuantity:
    """A number of a certificate."""

    path: tuple[str, ...]
    """Names of the quantity and the enclosing results, outermost first."""
    words: tuple[str, ...]
    """Names in all languages and ``refType`` of each level, outermost first."""
    value: float
    unit: str
    expanded: float | None
    k: float | None
    """`expanded`, `k`: Expanded uncertainty in the same unit, and its coverage factor, or None."""
    conformity: str
    """As stated in the certificate; may be empty."""

    @property
    def name(self) -> str:
        return " / ".join(self.path)


@dataclass(frozen=True, slots=True)
class Dcc:
    number: str
    title: str
    """From its statements, with SIMULATED or PRACTICE; may be empty."""
    laboratory: str
    customer: str
    items: tuple[tuple[str, tuple[str, ...]], ...]
    """Calibrated items, with all identifications."""
    begin: str
    end: str
    """`begin`, `end`: Dates of the calibration, ISO 8601."""
    quantities: tuple[DccQuantity, ...]
    """All numbers of the results, in order."""
    left_out: tuple[str, ...]
    """Quantities that are no real numbers or lists of them."""
    sha256: str
    signature: XmlSignature
    """State of the XML signature in it; only signed content is read if it is valid."""
    canonical: bytes
    """Canonical form (C14N) of the whole document, which a detached signature covers."""


def read_dcc(content: bytes, trusted: TrustedSigners | None = None) -> Dcc:
    """Return the content of a certificate.

    `trusted`: signers whose XML signatures are trusted; None for none. InputError: it is no DCC of
    version 3, too large or too deep, has a document type, or an invalid number.
    """
    document = _root(content)
    signature, root = xml_signature(document, content, trusted or TrustedSigners())
    core = f"{{{DCC}}}administrativeData/{{{DCC}}}coreData/{{{DCC}}}"
    found: list[DccQuantity] = []
    left_out: list[str] = []
    for result in root.iterfind(f"{{{DCC}}}measurementResults/{{{DCC}}}measurementResult"):
        results = result.find(f"{{{DCC}}}results")
        if results is not None:
            _read_quantities(results, result, found, left_out)
    return Dcc(
        number=root.findtext(f"{core}uniqueIdentifier") or "",
        title=_title(root),
        laboratory=_content(root, "administrativeData/calibrationLaboratory/contact/name"),
        customer=_content(root, "administrativeData/customer/name"),
        items=tuple(
            (_named(item), tuple(text for text in _marks(item) if text))
            for item in root.iterfind(f"{{{DCC}}}administrativeData/{{{DCC}}}items/{{{DCC}}}item")
        ),
        begin=root.findtext(f"{core}beginPerformanceDate") or "",
        end=root.findtext(f"{core}endPerformanceDate") or "",
        quantities=tuple(found),
        left_out=tuple(left_out),
        sha256=hashlib.sha256(content).hexdigest(),
        signature=signature,
        canonical=_canonical(document),
    )


def _canonical(root: etree._Element) -> bytes:
    try:
        return bytes(etree.tostring(root.getroottree(), method="c14n", with_comments=True))
    except etree.LxmlError as error:
        raise _refused(f"it has no canonical form ({str(error)[:80]})") from error


def _root(content: bytes) -> etree._Element:
    if len(content) > LARGEST:
        raise _refused(f"it has {len(content)} bytes, more than {LARGEST}")
    try:
        root = untrusted_xml(content, comments=True)
    except ValueError as error:
        raise _refused(str(error)[:200]) from error
    if root.tag != f"{{{DCC}}}digitalCalibrationCertificate":
        raise _refused(f"it begins with {str(root.tag)[:80]}")
    version = root.get("schemaVersion", "")
    if not version.startswith(_VERSIONS):
        raise _refused(f"its version is {version[:20]!r}, and 3 is read")
    for node in root.iter():
        if node.tag is etree.Entity:
            raise _refused("it has an entity")
        if node.tag in _NO_ELEMENTS and _in_text(node):
            raise _refused("a comment divides a text, which may be read as two")
        if sum(1 for _ in node.iterancestors()) > _DEEPEST:
            raise _refused(f"it is nested more than {_DEEPEST} levels deep")
    return root


def _in_text(node: etree._Element) -> bool:
    """Return whether a comment or instruction is inside a text."""
    parent = node.getparent()
    return (
        parent is not None
        and bool("".join(map(str, parent.itertext())).strip())
        and all(one.tag in _NO_ELEMENTS for one in parent)
    )


def _read_quantities(
    results: etree._Element, top: etree._Element, found: list[DccQuantity], left_out: list[str]
) -> None:
    """Add the quantities of a result, and the names of unread ones."""
    for node in results.iter(f"{{{DCC}}}quantity"):
        levels = [node]
        for above in node.iterancestors():
            if above is results:
                break
            # A limit is inside the quantity that it limits.
            if above.tag in (f"{{{DCC}}}result", f"{{{DCC}}}list", f"{{{DCC}}}quantity"):
                levels.insert(0, above)
        levels.insert(0, top)
        path = tuple(name for level in levels if (name := _named(level)))
        numbers = list(_numbers(node))
        if not numbers and node.find(f"{{{DCC}}}noQuantity") is None:
            left_out.append(" / ".join(path))
        conformity = node.findtext(
            f"{{{DCC}}}measurementMetaData/{{{DCC}}}metaData/{{{DCC}}}conformity"
        )
        words = tuple(_all_words(level) for level in levels)
        for index, (value, unit, expanded, k) in enumerate(numbers, 1):
            own = path if len(numbers) == 1 else (*path, f"[{index}]")
            told = (conformity or "").strip()
            found.append(DccQuantity(own, words, value, unit, expanded, k, told))
        if len(found) > _MOST:
            raise _refused(f"it has more than {_MOST} quantities")


def _numbers(node: etree._Element) -> Iterator[tuple[float, str, float | None, float | None]]:
    """Yield value, unit, expanded uncertainty and k of a real number, or of a list of them."""
    real, many = node.find(f"{{{SI}}}real"), node.find(f"{{{SI}}}realListXMLList")
    if real is not None:
        expanded, k = (_texts(real, names) for names in _UNCERTAINTY)
        if real.find(f".//{{{SI}}}valueStandardMU") is not None:
            expanded, k = _texts(real, ("valueStandardMU",)), ["1"]
        yield (
            _number(real.findtext(f"{{{SI}}}value")),
            (real.findtext(f"{{{SI}}}unit") or "").strip(),
            _number(expanded[0]) if expanded else None,
            _number(k[0]) if k else None,
        )
    elif many is not None:
        values = _texts(many, ("valueXMLList",))
        lists = [_texts(many, ("unitXMLList",))]
        lists += [_texts(many, tuple(f"{one}XMLList" for one in names)) for names in _UNCERTAINTY]
        for one in lists:
            if len(one) not in (0, 1, len(values)):
                raise _refused(f"a list of {len(values)} values has {len(one)} units or U")
        for index, value in enumerate(values):
            unit, expanded_at, k_at = (
                None if not one else one[0 if len(one) == 1 else index] for one in lists
            )
            yield (
                _number(value), unit or "",
                None if expanded_at is None else _number(expanded_at),
                None if k_at is None else _number(k_at),
            )  # fmt: skip


def _texts(parent: etree._Element, names: tuple[str, ...]) -> list[str]:
    """Return the words of the first element of one of these names."""
    for name in names:
        found = parent.find(f".//{{{SI}}}{name}")
        if found is not None:
            return (found.text or "").split() or [""]
    return []


def _all_words(level: etree._Element) -> str:
    """Return the names of a level in all languages, with its ``refType``."""
    contents = level.iterfind(f"{{{DCC}}}name/{{{DCC}}}content")
    names = [" ".join((one.text or "").split())[:_LONGEST_NAME] for one in contents]
    return " ".join((*names, level.get("refType", "").replace("_", " ")))


def _number(text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError as error:
        raise _refused(f"{(text or '')[:40]!r} is no number") from error
    # Python accepts underscores in numbers, XML does not.
    if not math.isfinite(value) or "_" in (text or ""):
        raise _refused(f"{(text or '')[:40]!r} is no number")
    return value


def _named(node: etree._Element) -> str:
    text = node.findtext(f"{{{DCC}}}name/{{{DCC}}}content") or ""
    return " ".join(text.split())[:_LONGEST_NAME]


def _content(root: etree._Element, path: str) -> str:
    steps = "/".join(f"{{{DCC}}}{step}" for step in (*path.split("/"), "content"))
    return " ".join((root.findtext(steps) or "").split())[:_LONGEST_NAME]


def _title(root: etree._Element) -> str:
    steps = ("administrativeData", "statements", "statement", "declaration", "content")
    for node in root.iterfind("/".join(f"{{{DCC}}}{step}" for step in steps)):
        name, mark, told = (node.text or "").partition(": ")
        if mark and name == "Title":
            return " ".join(told.split())[:_LONGEST_NAME]
    return ""


def _marks(item: etree._Element) -> Iterator[str]:
    for mark in item.iterfind(f"{{{DCC}}}identifications/{{{DCC}}}identification"):
        yield (mark.findtext(f"{{{DCC}}}value") or "").strip()[:_LONGEST_NAME]


def _refused(why: str) -> InputError:
    return InputError(
        "dcc.unreadable",
        f"This is no digital calibration certificate that can be read: {why}.",
        "Ask the laboratory for the certificate as DCC 3 (XML), or type it in.",
    )

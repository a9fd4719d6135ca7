"""Schema of DCC 3.2.1, made of that of 3.1.2."""

from __future__ import annotations

from pathlib import Path

import signxml
from lxml import etree

_DS = "http://www.w3.org/2000/09/xmldsig#"
_END = 'type="dcc:byteDataType" minOccurs="0"/>\n        </xs:sequence>'
_TEXT = """<xs:simpleType name="notEmpty"><xs:restriction base="xs:string">
<xs:pattern value="[^\\s]+(\\s+[^\\s]+)*"/></xs:restriction></xs:simpleType></xs:schema>"""


def dcc_schema(reference: Path) -> etree.XMLSchema:
    """Return the schema of DCC 3.1.2 with the changes of 3.2.1 that concern our certificates.

    PTB's 3.2.1 admits ``ds:Signature`` at the end, and no empty strings.
    """
    folder = reference / "dcc"
    text = (folder / "dcc.xsd").read_text("utf-8")
    signature = Path(signxml.__file__).parent / "schemas" / "xmldsig-core-schema.xsd"
    imported = f'<xs:import namespace="{_DS}" schemaLocation="{signature}"/>'
    admitted = '<xs:element ref="ds:Signature" minOccurs="0" maxOccurs="unbounded"/>'
    for old, new in (
        ('"SI_Format.xsd"', f'"{folder / "SI_Format.xsd"}"'),
        (r"3\.1\.2", r"3\.2\.1"),
        ('xmlns:dcc="https', f'xmlns:ds="{_DS}" xmlns:dcc="https'),
        ("    <xs:annotation>", f"{imported}<xs:annotation>"),
        (_END, _END.replace("</xs", f"{admitted}</xs")),
        ('type="xs:string"', 'type="dcc:notEmpty"'),
        ("</xs:schema>", _TEXT),
    ):
        assert old in text, old
        once = old.endswith(("annotation>", "sequence>"))
        text = text.replace(old, new, 1 if once else -1)
    return etree.XMLSchema(etree.fromstring(text.encode()))

"""Certificates of calibration as DCC without a seal, and the clauses that they leave open."""

from __future__ import annotations

from lxml import etree

from ocmm_core.export.certificate import Certificate, certificate_facts
from ocmm_core.export.certificate._dcc import dcc_tree

# Of ISO/IEC 17025:2017. Omitted: h (calibrated on site), k and p as for reports, and opinions
# (7.8.4.1 f).
CLAUSES = (
    "7.8.2.1 a", "7.8.2.1 b", "7.8.2.1 c", "7.8.2.1 d", "7.8.2.1 e", "7.8.2.1 f", "7.8.2.1 g",
    "7.8.2.1 i", "7.8.2.1 j", "7.8.2.1 l", "7.8.2.1 m", "7.8.2.1 n", "7.8.2.1 o", "7.8.4.1 a",
    "7.8.4.1 b", "7.8.4.1 c", "7.8.4.1 d", "7.8.4.1 e",
)  # fmt: skip


def dcc_bytes(paper: Certificate) -> bytes:
    content: bytes = etree.tostring(dcc_tree(paper), xml_declaration=True, encoding="UTF-8")
    return content


def open_certificate_clauses(paper: Certificate) -> tuple[str, ...]:
    said = {fact.clause for fact in certificate_facts(paper) if fact.stated}
    return tuple(clause for clause in CLAUSES if clause not in said)

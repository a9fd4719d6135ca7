"""The certificate of a bar or a sphere becomes its artefact document: nobody types a number.

Value, U and k are those of the certificate; U is brought to k = 2. When the certificate is due is a
rule of the user, because no certificate says it. What the certificate does not state (expansion) is
given beside it, with its uncertainty, or the document is not made.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from ocmm_core.errors import InputError
from ocmm_core.export.certificate._content import K
from ocmm_core.export.certificate._reader import Dcc, DccQuantity

_MM_PER = {
    "\\metre": 1e3, "\\milli\\metre": 1.0, "\\micro\\metre": 1e-3, "\\nano\\metre": 1e-6,
}  # fmt: skip
_PER_KELVIN = {
    "\\kelvin\\tothe{-1}": 1.0, "\\per\\kelvin": 1.0, "\\micro\\kelvin\\tothe{-1}": 1e-6,
    "\\micro\\per\\kelvin": 1e-6,
}  # fmt: skip
_SCHEMAS = {"bar": "ocmm.length-bar/1", "sphere": "ocmm.sphere/1"}
_DATE = re.compile(r"\d{4}-\d{2}-\d{2}")


@dataclass(frozen=True, slots=True)
class Expansion:
    """Thermal expansion and its standard uncertainty, 1/K."""

    value: float
    sigma: float


def artefact_text(
    dcc: Dcc,
    kind: Literal["bar", "sphere"],
    due: str,
    *,
    quantity: str = "",
    expansion: Expansion | None = None,
) -> str:
    """Return the artefact document (TOML) of a certificate.

    Parameters
    ----------
    due
        Until when the certificate holds, ``YYYY-MM-DD``, by the rule of the user.
    quantity
        Part of the name of the length or diameter, where the certificate has several.
    expansion
        Where the certificate states none.

    Raises
    ------
    InputError
        The certificate states no such length with an expanded uncertainty, or several, or no
        expansion; or ``due`` is no date.
    """
    if not _DATE.fullmatch(due):
        raise InputError("dcc.due", f"Due date {due!r} is no date.", "Give it as YYYY-MM-DD.")
    length = _the_length(dcc, quantity)
    grows = _expansion(dcc) or expansion
    if grows is None:
        raise InputError(
            "dcc.expansion",
            f"Certificate {dcc.number} states no thermal expansion.",
            "Give it with its standard uncertainty (--expansion, --expansion-sigma), 1/K.",
        )
    scale = _MM_PER[length.unit]
    value, expanded = scale * length.value, scale * _at_k2(length)
    name, marks = dcc.items[0] if dcc.items else ("", ())
    size = (
        f"diameter = {value!r}" if kind == "sphere" else f"nests = [0.0, {value!r}]"
    )  # fmt: skip
    return "\n".join(
        (
            f"# From certificate {_quoted(dcc.number)}: {_quoted(length.name)}.",
            f"schema = {_quoted(_SCHEMAS[kind])}",
            'unit = "mm"',
            f"name = {_quoted(name or kind)}",
            f"serial = {_quoted(marks[0] if marks else 'not stated')}",
            size,
            f"expanded = {expanded!r}",
            f"expansion = {grows.value!r}",
            f"expansion_sigma = {grows.sigma!r}",
            "",
            "[certificate]",
            f"number = {_quoted(dcc.number)}",
            f"sha256 = {_quoted(dcc.sha256)}",
            f"due_utc = {_quoted(due + 'T00:00:00+00:00')}",
            "",
        )
    )


def artefact_fields(
    dcc: Dcc, kind: Literal["bar", "sphere"], *, quantity: str = ""
) -> dict[str, str]:
    """Return what a certificate states of an artefact, as fields for `acceptance.typed_entry`.

    Numbers have all their digits. What no certificate says (id, due date) is missing, and so is the
    expansion where it is not stated. Parameters and errors as in `artefact_text`.
    """
    length, grows = _the_length(dcc, quantity), _expansion(dcc)
    scale = _MM_PER[length.unit]
    value = scale * length.value
    name, marks = dcc.items[0] if dcc.items else ("", ())
    fields = {
        "kind": kind, "name": name or kind, "serial": marks[0] if marks else "",
        "laboratory": dcc.laboratory, "certificate": dcc.number,
        "certificate_sha256": dcc.sha256, "source": f"DCC {dcc.number}",
        "sizes": repr(value) if kind == "sphere" else f"0.0 {value!r}",
        "expanded": repr(scale * _at_k2(length)),
    }  # fmt: skip
    if grows is not None:
        fields |= {"expansion": repr(grows.value), "expansion_sigma": repr(grows.sigma)}
    return fields


def _the_length(dcc: Dcc, wanted: str) -> DccQuantity:
    lengths = [
        one
        for one in dcc.quantities
        if one.unit in _MM_PER and one.k and one.expanded is not None and one.value > 0.0
        and wanted.casefold() in one.name.casefold()
    ]  # fmt: skip
    if len(lengths) == 1:
        return lengths[0]
    names = "; ".join(one.name for one in lengths[:6])
    raise InputError(
        "dcc.length",
        f"Certificate {dcc.number} states {len(lengths) or 'no'} lengths with an expanded "
        f"uncertainty{f': {names}' if names else ''}.",
        "Name the one that is meant by a part of its name (--quantity), or type the document.",
    )


def _at_k2(quantity: DccQuantity) -> float:
    """Return the expanded uncertainty brought to k = 2."""
    expanded, k = quantity.expanded, quantity.k
    if expanded is None or k is None or k <= 0.0 or expanded <= 0.0:
        raise InputError(
            "dcc.uncertainty",
            f"{quantity.name}: the certificate states U = {expanded}, k = {k}.",
            "Ask the laboratory for a certificate with a valid uncertainty.",
        )
    return expanded * K / k


def _expansion(dcc: Dcc) -> Expansion | None:
    for one in dcc.quantities:
        scale = _PER_KELVIN.get(one.unit)
        if scale is not None and one.k and one.expanded is not None:
            return Expansion(scale * one.value, scale * one.expanded / one.k)
    return None


def _quoted(text: str) -> str:
    """Return a text as TOML holds it: without what ends it or begins something else."""
    plain = "".join(sign if sign.isprintable() else " " for sign in text)
    return '"' + plain.replace("\\", "\\\\").replace('"', '\\"') + '"'

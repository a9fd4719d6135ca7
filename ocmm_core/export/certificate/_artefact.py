"""Convert the certificate of a bar or a sphere to its artefact document, without typing numbers.

The quantity is chosen by words of its name and refType: a diameter, a doubled radius, or a length;
a roundness, a depth, an error or a nominal value is excluded. Ambiguous or unknown names need
``--quantity``. Value, U and k are those of the certificate; U is converted to k = 2. The user gives
the due date, and the expansion if the certificate has none.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from ocmm_core.errors import InputError
from ocmm_core.export.certificate._content import K
from ocmm_core.export.certificate._reader import Dcc, DccQuantity
from ocmm_core.export.certificate._xml_signature import XmlSignatureWord
from ocmm_core.units import MeasureUnit, find_unit, scaled

_CLASSES = {
    "other": (
        r"roundness|rundheit|circularit|sphericit|\bform\b|formabw|cylindric|zylind|flatness|"
        r"ebenheit|straightness|geradheit|parallel|rough|rauheit|deviation|abweichung|error|"
        r"fehler|differen|correction|korrektur|limit|grenz|toleran|\bmpe\b|permissible|zulässig|"
        r"depth|tiefe|immersion|eintauch|wavelength|wellenlänge|uncertainty|unsicherheit|"
        r"repeatab|wiederhol|drift|\bstep|resolution|auflösung|nominal|nenn|\bsoll|setpoint|"
        r"reference ?value|expansion|ausdehnung|offset|thickness|dicke|height|höhe|width|breite|"
        r"\bstem|shank|schaft|position|coordinate|koordinate"
    ),
    "diameter": r"di[aá]m[eè]t|durchmesser|[øØ⌀]",
    "radius": r"radius|radii|halbmesser|\brayon|\bradio\b|raggio",
    "length": (r"length|länge|longueur|longitud|lunghezza|distan[cz]|abstand|spacing"),
}
"""Words of a name in several languages; the first matching class decides."""
_WANTED: dict[str, dict[str, float]] = {
    "sphere": {"diameter": 1.0, "radius": 2.0}, "bar": {"length": 1.0},
}  # fmt: skip
"""Classes that give the size of an artefact, with their factor."""
_PER_KELVIN = {
    "\\kelvin\\tothe{-1}": 1.0, "\\per\\kelvin": 1.0, "\\micro\\kelvin\\tothe{-1}": 1e-6,
    "\\micro\\per\\kelvin": 1e-6,
}  # fmt: skip
_GROWS = r"expansion|ausdehnung|dilata[tcz]|\bcte\b"
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
        End of validity, ``YYYY-MM-DD``, by the rule of the user.
    quantity
        Part of the name of the length or diameter, if ambiguous or unknown.
    expansion
        For a certificate without one.

    Raises
    ------
    InputError
        The certificate has no such length with an expanded uncertainty, or several, or several
        items, or no expansion; or ``due`` is no date.
    """
    if not _DATE.fullmatch(due):
        raise InputError("dcc.due", f"Due date {due!r} is no date.", "Give it as YYYY-MM-DD.")
    length, factor = _the_length(dcc, kind, quantity)
    grows = _expansion(dcc) or expansion
    if grows is None:
        raise InputError(
            "dcc.expansion",
            f"Certificate {dcc.number} states no thermal expansion.",
            "Give it with its standard uncertainty (--expansion, --expansion-sigma), 1/K.",
        )
    value, expanded = _in_mm(length, factor)
    name, marks = _item(dcc)
    size = (
        f"diameter = {value!r}" if kind == "sphere" else f"nests = [0.0, {value!r}]"
    )  # fmt: skip
    return "\n".join(
        (
            f"# From certificate {_quoted(dcc.number)}: {_quoted(length.name)}"
            f"{' (radius, doubled)' if factor == 2.0 else ''}. {_quoted(dcc.signature.summary)}.",
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
    """Return the data of an artefact's certificate, as fields for `acceptance.typed_entry`.

    Numbers have all their digits. Id and due date are missing, and so is an unstated expansion.
    Parameters and errors as in `artefact_text`.
    """
    (length, factor), grows = _the_length(dcc, kind, quantity), _expansion(dcc)
    value, expanded = _in_mm(length, factor)
    name, marks = _item(dcc)
    fields = {
        "kind": kind, "name": name or kind, "serial": marks[0] if marks else "",
        "laboratory": dcc.laboratory, "certificate": dcc.number,
        "certificate_sha256": dcc.sha256,
        "source": f"DCC {dcc.number}" + (", radius doubled" if factor == 2.0 else "")
        + f", XML signature {dcc.signature.word.value}",
        "sizes": repr(value) if kind == "sphere" else f"0.0 {value!r}",
        "expanded": repr(expanded),
    }  # fmt: skip
    if grows is not None:
        fields |= {"expansion": repr(grows.value), "expansion_sigma": repr(grows.sigma)}
    return fields


def quantities_read(
    dcc: Dcc, kind: Literal["bar", "sphere"], *, quantity: str = ""
) -> tuple[DccQuantity, ...]:
    """Return the quantities of a certificate that its artefact document is made from.

    Parameters and errors as in `artefact_text`.
    """
    return _the_length(dcc, kind, quantity)[0], *(one for _, one in _expansions(dcc))


def _the_length(dcc: Dcc, kind: Literal["bar", "sphere"], asked: str) -> tuple[DccQuantity, float]:
    """Return the size of the artefact, and 2 for a radius."""
    if dcc.signature.word is XmlSignatureWord.INVALID:
        raise InputError(
            "dcc.signature",
            f"Certificate {dcc.number}: {dcc.signature.summary}.",
            "Ask the laboratory for the certificate again.",
        )
    lengths = [
        one
        for one in dcc.quantities
        if _unit_of(one) is not None and one.k and one.expanded is not None and one.value > 0.0
        and asked.casefold() in one.name.casefold()
    ]  # fmt: skip
    classes = [_class_of(one) for one in lengths]
    wanted = _WANTED[kind]
    fitting = [
        (one, wanted[word]) for one, word in zip(lengths, classes, strict=True) if word in wanted
    ]
    if not fitting and asked:
        # Named by the user, without contradiction.
        fitting = [
            (one, 1.0) for one, word in zip(lengths, classes, strict=True) if word == "unnamed"
        ]
    if len(fitting) == 1:
        return fitting[0]
    names = "; ".join(
        f"{one.name} ({word})" for one, word in list(zip(lengths, classes, strict=True))[:6]
    )
    size = "diameters or radii" if kind == "sphere" else "lengths"
    raise InputError(
        "dcc.length",
        f"Certificate {dcc.number} states {len(fitting) or 'no'} {size} with an expanded "
        f"uncertainty{f'; it has: {names}' if names else ''}.",
        "Name one by a part of its name (--quantity), or type the document.",
    )


def _unit_of(quantity: DccQuantity) -> MeasureUnit | None:
    """Return the unit of a length in D-SI notation (a backslash before each word)."""
    return find_unit(quantity.unit, "length") if quantity.unit.startswith("\\") else None


def _in_mm(quantity: DccQuantity, factor: float) -> tuple[float, float]:
    """Return ``factor`` times a length and its expanded uncertainty (k = 2), mm."""
    unit = _unit_of(quantity)
    scale = factor * (1.0 if unit is None else unit.factor)
    return scaled(quantity.value, scale), scaled(_at_k2(quantity), scale)


def _class_of(quantity: DccQuantity) -> str:
    """Return the class of a length, by the innermost known name."""
    for words in reversed(quantity.words):
        for word, pattern in _CLASSES.items():
            if re.search(pattern, words, re.IGNORECASE):
                return word
    return "unnamed"


def _item(dcc: Dcc) -> tuple[str, tuple[str, ...]]:
    """Return name and identifications of the item; InputError if there are several."""
    if len(dcc.items) > 1:
        raise InputError(
            "dcc.items",
            f"Certificate {dcc.number} is about {len(dcc.items)} items.",
            "Ask for a certificate of the one item, or type the document.",
        )
    return dcc.items[0] if dcc.items else ("", ())


def _at_k2(quantity: DccQuantity) -> float:
    """Return the expanded uncertainty converted to k = 2."""
    expanded, k = quantity.expanded, quantity.k
    if expanded is None or k is None or k <= 0.0 or expanded <= 0.0:
        raise InputError(
            "dcc.uncertainty",
            f"{quantity.name}: the certificate states U = {expanded}, k = {k}.",
            "Ask the laboratory for a certificate with a valid uncertainty.",
        )
    return expanded * K / k


def _expansions(dcc: Dcc) -> list[tuple[float, DccQuantity]]:
    """Return the thermal expansions stated with their uncertainty, each with its unit in 1/K."""
    return [
        (scale, one)
        for one in dcc.quantities
        if (scale := _PER_KELVIN.get(one.unit)) is not None
        and one.k and one.expanded is not None
        and re.search(_GROWS, " ".join(one.words), re.IGNORECASE)
    ]  # fmt: skip


def _expansion(dcc: Dcc) -> Expansion | None:
    """Return the only thermal expansion stated with its uncertainty."""
    found = _expansions(dcc)
    if len(found) > 1:
        raise InputError(
            "dcc.expansion",
            f"Certificate {dcc.number} states {len(found)} thermal expansions.",
            "Ask for a certificate of the one item, or type the document.",
        )
    for scale, one in found:
        return Expansion(scale * one.value, 0.5 * scale * _at_k2(one))
    return None


def _quoted(text: str) -> str:
    """Return a TOML string without characters that could end it."""
    plain = "".join(sign if sign.isprintable() else " " for sign in text)
    return '"' + plain.replace("\\", "\\\\").replace('"', '\\"') + '"'

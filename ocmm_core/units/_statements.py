"""Places in text that state a unit: comments, titles and headings of columns."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from ocmm_core.units._unit import MeasureUnit, find_unit


@dataclass(frozen=True, slots=True)
class UnitStatement:
    """The statement of a unit of length."""

    text: str
    unit: MeasureUnit | None
    """None if it is unknown or the statement names several."""
    is_mention: bool = False
    """A unit is named outside a statement: it counts only without other evidence."""


_LABEL = re.compile(
    r"\b(?:length|coordinate|measuring|measurement|linear|\w{0,8})?[ _-]?"
    r"(units?|uom|einheit(?:en)?|\w{0,12}einheit(?:en)?|unités?|unidad(?:es)?|unità|unidades?|"
    r"eenhe(?:id|den)|enhet(?:er)?|jednostk[ai]|"
    r"единиц[аы](?:\s+измерения)?|单位|單位|単位|단위)(?:\b|(?=\s*[:=]))"
    r"(?:\s*(?:of|for)\s+(?:all\s+)?(?:lengths?|measure(?:ments?)?|coordinates|values))?"
    r"(?P<mark>(?:\s*[:=/,]|\s+(?:are|is|in|sind|ist|son|sont|all)\b)*)\s*(?P<rest>.*)",
    re.IGNORECASE,
)
"""Strong marks (: = /) state a unit even if it is unknown; "is" and "in" may be prose."""
_CONTENTS = re.compile(
    r"\b(?P<what>coordinates?|values?|dimensions?|lengths?|distances?|measurements?|points|data|x|y|z|"
    r"all|everything|exported|saved|given|written|expressed|stated|"
    r"koordinaten|werte|maße|masse|angaben?|längen?|messwerte|punkte|daten|alles|"
    r"coordonnées|valeurs|dimensiones|coordenadas|valores|coordinate|valori)\b"
    r"(?P<between>[^.;]{0,80}?)\b(?:in|en)\s+(?P<unit>[^\s,;)(]+(?:\s[^\s,;)(]+)?)\s*[.,;)]*\s*$",
    re.IGNORECASE,
)
_STRICT = frozenset(
    re.findall(
        r"\S+",
        "coordinates values dimensions lengths distances koordinaten werte maße längen angaben",
    )
)
_FILLERS = re.compile(
    r"(?:\s|,|\(|are|is|all|given|stated|expressed|x|y|z|and|sind|alle|angegeben|\))*",
    re.IGNORECASE,
)
_ENDING = re.compile(r"\bin\s+(?P<unit>[^\s,;)(]{2,})\s*[.,;)]*\s*$", re.IGNORECASE)
_SYSTEM = re.compile(r"\b(?P<unit>\S+)\s+(?:units?|einheiten)\s*[.)]?$", re.IGNORECASE)
_SYSTEMS = frozenset(
    re.findall(r"\S+", "metric imperial english si us customary metrisch metrische")
)
_MENTION = re.compile(
    r"(?<![\w\d])(?<!\d )(?<!\d-)(?P<unit>inch(?:es)?|zoll|pouces?|pulgadas?|pollic[ei]|feet|foot|"
    r"microns?|mikron|mils|thou|yards?|imperial|дюйм\w*|英寸|インチ|인치)(?!\w)",
    re.IGNORECASE,
)
"""Units other than mm, whose words have no other meaning; "2 inch stem" is a property."""
_WIDE = {0xFEE0 + ord(sign): sign for sign in ":=()[]/"}
"""Full-width signs of East Asian texts."""
_PARTS = re.compile(r"[,;()\[\]|]+|\s+(?:and|und|or|oder)\s+")
_CODES = {"g20": "inch", "g70": "inch", "g21": "mm", "g71": "mm"}
"""Words of NC programs that choose the unit."""
_SCALE = re.compile(
    r"\b(scale|scaling|scale[ _]?factor|skalierung|ma(?:ß|ss)stab|échelle|escala|scala|factor|"
    r"faktor)(?:\s*[:=]\s*|\s+(?=\d+(?:[.,]\d+)?\s*:))(\S+)",
    re.IGNORECASE,
)
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[({<]\s*(?P<unit>[^\])}>]*?)\s*[\])}>]\s*$")
_SLASH = re.compile(r"^(?P<name>[^/]+?)\s*/\s*(?P<unit>\S.*)$")
_BEHIND = re.compile(r"^(?P<name>.*?)[\s_,.-]+(?:in[\s_]+)?(?P<unit>[^\s/_]+)$")
_GLUED = re.compile(
    r"^(?P<name>[xyz])(?P<unit>mm|cm|in|inch|µm|μm|um|ft|\"|\u2033|')$", re.IGNORECASE
)
_QUALIFIERS = frozenset(
    re.findall(
        r"\S+",
        "actual act measured meas measurement nominal nom ist soll mean avg average mittel mess "
        "cad target design theo theoretical reference ref wcs global local machine world part",
    )
)
_NAME_PARTS = re.compile(r"(?P<count>\d[\s_-]*)?(?P<word>[^\W\d_]+|\")")
_HUMPS = re.compile(r"(?<=[a-z\d])(?=[A-Z])|(?<=[A-Z]{2})(?=[A-Z][a-z])")
_FUSED = re.compile(r"(?:inch(?:es)?|zoll|imperial)$")
_OTHER_WORDS = frozenset(("pinch", "winch", "finch", "clinch", "cinch"))
_VERSIONS = frozenset(("v", "r", "rev", "final", "copy", "new", "kopie", "neu", "version"))
_SHORT = frozenset(re.findall(r"\S+", "in m ft mi yd dm nm km hm dam tum å µ pie pies pied pieds"))
"""Names of units that are also words or initials: a unit only at the end of a file's name."""
_AMBIGUOUS_BEHIND = frozenset(re.findall(r"\S+", "m M a A n"))
"""Letters behind a name that may mean "measured", "mean", "actual" or "nominal"."""


def unit_statement(line: str) -> UnitStatement | None:
    """Return the unit of length that a comment or title states; None if it states none.

    A unit that is only mentioned, such as "All dimensions INCH", is a statement without a unit.
    """
    text = line.translate(_WIDE).strip().strip("#%!;/*$ \t").strip()
    if not text:
        return None
    found = _statement(text)
    mention = None if found is not None else _MENTION.search(text)
    return found if mention is None else UnitStatement(text, None, is_mention=True)


def _statement(text: str) -> UnitStatement | None:
    code = _CODES.get(text.lower())
    bare = find_unit(code or _without_brackets(text))
    if bare is not None:
        if text[0].isdigit() and bare.dimension == "length" and bare.factor != 1.0:
            # "25 mm" alone may be the size of the part.
            return UnitStatement(text, None, is_mention=True)
        return UnitStatement(code or text, bare) if bare.dimension == "length" else None
    label = _LABEL.search(text)
    if label is not None:
        found = _after_label(label["mark"], label["rest"])
        if found is not None:
            return found
    contents = _CONTENTS.search(text)
    if contents is not None:
        return _of_contents(contents)
    behind = _BRACKETS.match(text)
    if behind is not None and len(behind["unit"]) > 1:
        unit = find_unit(behind["unit"], "length")
        if unit is not None and behind["unit"].lower() not in ("in", "mi"):
            return UnitStatement(behind["unit"], unit)
    system = _SYSTEM.search(text)
    if system is not None and (
        (unit := find_unit(system["unit"], "length")) or system["unit"].lower() in _SYSTEMS
    ):
        return UnitStatement(system["unit"], unit)
    ending = _ENDING.search(text)
    if ending is not None and ending["unit"].lower() not in ("in", "mi", "tum"):
        unit = find_unit(ending["unit"], "length")
        # "probe radius in inches" may or may not apply to the points.
        if unit is not None:
            return UnitStatement(text, None) if unit.factor != 1.0 else None
    scale = _SCALE.search(text)
    if scale is not None and not re.fullmatch(r"1([.,]0*)?|1:1", scale[2]):
        return UnitStatement(scale[0], None)
    return None


def units_of_name(name: str) -> Iterator[UnitStatement]:
    """Yield the units of length in the name of a file: ``bore_inch.csv``, ``scan-in.xyz``.

    A number with its unit, such as ``ball_1inch.csv``, may be a size: it is a mention.
    """
    stem, dot, suffix = name.rpartition(".")
    parts = list(_NAME_PARTS.finditer(_HUMPS.sub(" ", stem if dot else name)))
    words = [(one["word"].casefold(), one["count"] is not None) for one in parts]
    while len(words) > 1 and words[-1][0] in _VERSIONS:
        words.pop()
    for place, (word, is_size) in enumerate([*words, (suffix.casefold(), False)]):
        inch = None if word in _OTHER_WORDS else _FUSED.search(word)
        is_open = word in _SHORT and (is_size or not 0 < place == len(words) - 1)
        unit = None if is_open else find_unit("inch" if inch else word, "length")
        if unit is not None:
            yield UnitStatement(word, unit, is_mention=is_size)


def heading_unit(cell: str) -> tuple[str, str]:
    """Return the name of a column and the text of its unit, empty if it has none.

    Text in brackets or behind a slash is returned, known or not; a word behind only if a unit.
    """
    text = cell.strip()
    for pattern in (_BRACKETS, _GLUED, _SLASH, _BEHIND):
        found = pattern.match(text)
        if found is None or not found["name"].strip():
            continue
        name, unit = found["name"].strip(), found["unit"].strip()
        if pattern is _BRACKETS:
            unit = re.sub(r"^(?:all\s+)?(?:in|unit:?)\s+(?=\S)", "", unit, flags=re.IGNORECASE)
            inner, of_inner = heading_unit(name)
            if set(re.split(r"[\s_,/-]+", unit.lower())) <= _QUALIFIERS:
                return (f"{inner} {unit}", of_inner)
            return name, unit
        if pattern is _GLUED or pattern is _SLASH:
            return name, unit
        if unit not in _AMBIGUOUS_BEHIND and find_unit(unit, "length") is not None:
            return re.sub(r"[\s_,.-]+in$", "", name, flags=re.IGNORECASE), unit
    return text, ""


def _without_brackets(text: str) -> str:
    found = re.fullmatch(r"[\[({<]\s*([^\])}>]+?)\s*[\])}>]", text)
    return found[1] if found else text


def _after_label(mark: str, rest: str) -> UnitStatement | None:
    rest = rest.strip()
    is_strong = bool(re.search(r"[:=/]", mark)) or rest[:1] in ("[", "(")
    if len(rest) > 2 and rest[0] == rest[-1] and rest[0] in "\"'":
        rest = rest[1:-1].strip()
    rest = _without_brackets(rest)
    if not rest and re.search(r"[:=/]\s*in$|in\s+in$", mark.strip(), re.IGNORECASE):
        rest = "in"
    if not rest:
        return None
    named = [part for part in _PARTS.split(rest) if part.strip()]
    units = [_leading_unit(part) for part in named]
    if not any(units) and "/" in rest:
        # The slash of "1/100 mm" belongs to the unit, that of "mm/deg" separates two.
        named = [part for part in rest.split("/") if part.strip()]
        units = [_leading_unit(part) for part in named]
    lengths = [unit for unit in units if unit is not None and unit.dimension == "length"]
    lengths += _more_lengths(rest) if lengths else []
    if not lengths:
        if any(unit is not None for unit in units):
            return None
        # "unit is calibrated" is refused like an unknown unit; longer sentences are prose.
        is_statement = is_strong or (mark.strip() and len(rest.split()) == 1)
        return UnitStatement(rest, None) if is_statement else None
    if not mark.strip() and not is_strong and len(named) == 1 and len(rest.split()) > 2:
        return None
    same = all(abs(unit.factor / lengths[0].factor - 1.0) < 1e-9 for unit in lengths)
    return UnitStatement(lengths[0].symbol if same else rest, lengths[0] if same else None)


def _leading_unit(text: str) -> MeasureUnit | None:
    """Return the unit at the start of ``text``, of its longest run of words."""
    words = text.split()
    for count in range(min(5, len(words)), 0, -1):
        unit = find_unit(" ".join(words[:count]))
        if unit is not None:
            return unit
    return None


def _more_lengths(text: str) -> list[MeasureUnit]:
    """Return the lengths named anywhere in ``text``, without words that are also prose."""
    words = [word for word in re.split(r"[\s,;/()\[\]|]+", text) if len(word) > 1]
    if re.search(r"\d", text):
        return []
    units = [find_unit(word, "length") for word in words if word.lower() not in ("in", "mi", "tum")]
    return [unit for unit in units if unit is not None]


def _of_contents(found: re.Match[str]) -> UnitStatement | None:
    words = found["unit"].split()
    candidates = [found["unit"], words[0]] if len(words) > 1 else [found["unit"]]
    unit = find_unit(candidates[0], "length")
    if unit is not None:
        return UnitStatement(candidates[0], unit)
    is_direct = _FILLERS.fullmatch(found["between"]) is not None
    if len(words) == 1 and is_direct and found["what"].lower() in _STRICT:
        return UnitStatement(found["unit"], None)
    return None

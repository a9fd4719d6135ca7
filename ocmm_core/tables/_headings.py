"""Headings of columns in the words of several programs and languages."""

from __future__ import annotations

import re
import unicodedata

from ocmm_core.units import heading_unit

_WORDS = {
    "x": "x easting east este est ost rechtswert rechts 东 东坐标",
    "y": "y northing north norte nord hochwert hoch 北 北坐标",
    "z": "z height elevation elev altitude hoehe höhe hohe hauteur altura cota quota altitud "
    "高 高程",
    "i": "i nx",
    "j": "j ny",
    "k": "k nz",
    "name": (
        "name id nr no num number point pt pnt punkt punktnr pointid pointname label feature index "
        "pkt pktnr nom nombre nome nazwa n n° repère punto "
        "番号 点名 点号 名称 编号 점 точка "
        "idx nummer punktname bezeichnung count # element row"
    ),
    "sigma": "sigma uncertainty",
    "unit": "unit units einheit uom",
}
_ROLE_OF = {word: role for role, words in _WORDS.items() for word in words.split()}
_NOISE = frozenset(
    re.findall(
        r"\w+",
        "coord coords coordinate coordinates koordinate koordinaten position pos value wert werte "
        "axis achse the location loc point punkt pt coordonnée coordonnées coordenada coordenadas "
        "coordinata współrzędna valeur valor valore eje asse",
    )
)
_MEASURED = frozenset(
    re.findall(
        r"\w+", "actual act measured meas ist mess messwert gemessen mesuré mesure medido misurato"
    )
)
_NOMINAL = frozenset(
    re.findall(
        r"\w+",
        "nominal nom soll cad target design theo theoretical ref reference théorique nominale "
        "teorico teórico nennwert",
    )
)
_NORMAL = frozenset(re.findall(r"\w+", "normal normals norm direction dir"))
_GLUED = re.compile(
    r"(?P<a>act|actual|meas|measured|ist|nom|nominal|soll|pos|coord|point|p|实测|测量|理论|名义)?(?P<axis>[xyz])"
    r"(?P<b>act|actual|meas|measured|ist|nom|nominal|soll|pos|coord|koord|wert|achse|座標|坐标)?"
)
SUMMARY = re.compile(
    r"(?:x?mean|average|avg|std|stdev|stddev|stdabw|sd|sigma|min|max|minimum|maximum|range|sum|total|"
    r"count|median|rms|var|variance|mittel|mittelwert|stabw|standardabweichung|"
    r"standarddeviation|summe|gesamt|anzahl|spannweite|streuung|varianz|moyenne|ecarttype|media|"
    r"promedio|desviacion|somme|totale|minimo|maximo|medie|peaktopeak|tolerance|toleranz|nominal|soll|"
    r"durchschnitt|maximalwert|minimalwert|nennmass|nennwert|sollwert|minimal|maximal|mediane|"
    r"mediana|desvio|desvest|scarto|srednia|平均|均值|平均值|标准差|标准偏差|标准|最大|最大值|最小|最小值|合计|"
    r"总和|中位数|公差|上限|下限|平均値|標準偏差|最大値|最小値|合計|среднее|ско|минимум|максимум|сумма|"
    r"end|ende|eof|endoffile|usl|lsl|limit|limits|spread|deviation|stddeviation|stderr|error|offset|"
    r"date|datum|time|uhrzeit|serial|temperature|temperatur)"
    r"(?:value|values|wert|werte|dev|deviation|of|x|xyz|all|points)?"
)
"""First cells of rows that are not points, without blanks and signs."""


def role_of(heading: str) -> str:
    """Return x, y, z, i, j, k, name, sigma or unit, or "nominal x" etc.; empty if unknown."""
    name = heading_unit(heading)[0]
    folded = unicodedata.normalize("NFKC", name).casefold().strip().strip("\"'")
    if folded in _ROLE_OF:
        return _ROLE_OF[folded]
    words = [word for word in re.split(r"[\s_.:()\[\]/-]+", folded) if word]
    measured = _MEASURED.intersection(words)
    nominal = _NOMINAL.intersection(words)
    normal = _NORMAL.intersection(words)
    rest = [word for word in words if word not in measured | nominal | normal]
    core = [word for word in rest if word not in _NOISE] or rest[-1:]
    if len(core) != 1:
        return ""
    word = core[0]
    role = _ROLE_OF.get(word, "")
    if not role and (glued := _GLUED.fullmatch(word)) is not None:
        role = glued["axis"]
        if {glued["a"], glued["b"]} & (_NOMINAL | {"理论", "名义"}):
            nominal = nominal | {"nom"}
    if role in ("x", "y", "z"):
        if normal:
            return {"x": "i", "y": "j", "z": "k"}[role]
        return f"nominal {role}" if nominal else role
    if role == "name":
        return role if not measured | nominal | normal else ""
    return role if not measured | nominal else ""


def letters(text: str) -> str:
    """Return the letters of a cell without accents, for `SUMMARY`."""
    plain = unicodedata.normalize("NFKD", text.casefold())
    return "".join(sign for sign in plain if sign.isalpha())


def is_summary(cells: list[str]) -> bool:
    """Return whether the leading words of a row are those of a summary such as "Mean"."""
    return SUMMARY.fullmatch(letters("".join(cells))) is not None

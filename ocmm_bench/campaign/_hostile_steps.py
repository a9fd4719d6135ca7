"""Hostile models (ISO 10303-21) that typically crash C++ readers."""

from __future__ import annotations

import importlib.util
import random
import re
import subprocess
import sys
from functools import partial
from pathlib import Path

from ocmm_bench.campaign._hostile_forge import Forgery

_DAMAGED = 40
_GOOD = """
import sys
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
box = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), 100.0, 60.0, 20.0).Shape()
bore = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(20, 10, -1), gp_Dir(0, 0, 1)), 6.0, 30.0).Shape()
cone = BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(60, 30, -1), gp_Dir(0, 0, 1)), 4.0, 9.0, 30.0).Shape()
writer = STEPControl_Writer()
writer.Transfer(BRepAlgoAPI_Cut(BRepAlgoAPI_Cut(box, bore).Shape(), cone).Shape(), STEPControl_AsIs)
writer.Write(sys.argv[1])
"""


def has_models() -> bool:
    """Return whether models can be read: the extra ``step`` is installed."""
    return importlib.util.find_spec("OCP") is not None


def write_good_step(path: Path) -> None:
    """Write a block with a bore and a cone; needs the extra ``step``."""
    command = [sys.executable, "-c", _GOOD, str(path)]
    subprocess.run(command, check=True, capture_output=True)  # noqa: S603 - the text above


def step_kinds(good: str, seed: int) -> list[Forgery]:
    """Return kinds of hostile models, made from the text of a good one with one solid."""
    head, data = good.split("DATA;", 1)
    body, end = data.rsplit("ENDSEC;", 1)
    last = max(int(number) for number in re.findall(r"#(\d+)", body))
    whole = {
        "nothing but its first word": "ISO-10303-21;",
        "no data": f"{head}DATA;\nENDSEC;{end}",
        "no end": f"{head}DATA;{body}",
        "no head": f"ISO-10303-21;\nDATA;{body}ENDSEC;{end}",
        "a schema that nobody has": good.replace("AUTOMOTIVE_DESIGN", "X" * 1000),
        "twice the same": good + good,
        "twice the same data": f"{head}DATA;{body}{body}ENDSEC;{end}",
        "brackets without end": f"{head}DATA;{body}#{last + 1}=X({'(' * 100_000});ENDSEC;{end}",
        "a text without end": f"{head}DATA;{body}#{last + 1}=X('{'x' * 100_000};ENDSEC;{end}",
        "a long text": good.replace("'Open CASCADE", "'" + "y" * 1_000_000, 1),
        "a remark without end": f"{head}DATA;{body}/* ENDSEC;{end}",
        "a number of 5000 digits": _numbers(good, "9" * 5000, 1),
        "all numbers huge": _numbers(good, "1.E300", -1),
        "all numbers tiny": _numbers(good, "1.E-300", -1),
        "all numbers nought": _numbers(good, "0.", -1),
        "all numbers -1": _numbers(good, "-1.", -1),
        "numbers that are none": _numbers(good, "NAN", -1),
        "every name is the first": re.sub(r"#\d+", "#1", good),
        "names that are too long": re.sub(r"#(\d+)", r"#99999999999999999999\1", good),
        "every reference is its own": re.sub(
            r"(#\d+) ?=([^;]*);", lambda m: f"{m[1]}={re.sub('#[0-9]+', m[1], m[2])};", good
        ),
        "every reference is the next": re.sub(
            r"\(([^;]*)\);", lambda m: "(" + re.sub(r"#(\d+)", _next, m[1]) + ");", good
        ),
        "every entity is another": re.sub(r"= ?([A-Z_]+)\(", "=CARTESIAN_POINT(", good),
        "no name of a shape": good.replace("MANIFOLD_SOLID_BREP", "MANIFOLD_SOLID"),
        "no faces": good.replace("ADVANCED_FACE", "ADVANCED_FICE"),
        "100,000 more points": _more(
            head, body, end, last, "CARTESIAN_POINT('',(1.,2.,3.))", 100_000
        ),
        "a chain of 100,000": f"{head}DATA;{body}{_chain(last, 100_000)}ENDSEC;{end}",
        "units of nothing": re.sub(r"LENGTH_UNIT\(\)", "LENGTH_UNIT($)", good),
        "units in light years": good.replace(".MILLI.,.METRE.", ".EXA.,.METRE."),
        "markup in names": good.replace("'", "'<b>[/12]", 40),
        "control codes": good.replace("'", "'\x1b[2J", 40),
    }
    # Only a name, a remark, or one of several is odd in these.
    harmless = {
        "a long text", "markup in names", "control codes", "100,000 more points",
        "a chain of 100,000", "units in light years", "a schema that nobody has", "no head",
        "twice the same", "twice the same data", "units of nothing", "all numbers -1",
    }  # fmt: skip
    kinds = [
        Forgery(name, partial(_write, text.encode()), name in harmless)
        for name, text in whole.items()
    ]
    raw = {
        "no UTF-8": good.replace("'", "'\udcff\udcc3", 40).encode("utf-8", "surrogateescape"),
        "noughts behind it": good.encode() + bytes(1_000_000),
        "noughts within": good.encode()[:3000] + bytes(1000) + good.encode()[3000:],
        "UTF-16": b"ISO-10303-21;" + good.encode("utf-16"),
    }
    kinds += [
        Forgery(name, partial(_write, content), harmless=True) for name, content in raw.items()
    ]
    for number in range(_DAMAGED):
        content = _damaged(good, random.Random(f"{seed} {number}"))  # noqa: S311 - no secret
        kinds.append(Forgery(f"damaged {number}", partial(_write, content), harmless=True))
    return kinds


def _write(content: bytes, _good: Path, path: Path) -> None:
    path.write_bytes(content)


def _numbers(text: str, instead: str, most: int) -> str:
    """Replace reals of the data; -1 is all of them."""
    return re.sub(r"(?<=[(,])-?\d+\.\d*(?:E[+-]?\d+)?(?=[,)])", instead, text, count=max(most, 0))


def _next(found: re.Match[str]) -> str:
    return f"#{int(found[1]) + 1}"


def _more(head: str, body: str, end: str, last: int, entity: str, n: int) -> str:
    added = "".join(f"#{last + number}={entity};\n" for number in range(1, n + 1))
    return f"{head}DATA;{body}{added}ENDSEC;{end}"


def _chain(last: int, n: int) -> str:
    """Return a cyclic assembly: each product is part of the next, the last of the first."""
    return "".join(
        f"#{last + 1 + at}=SHAPE_REPRESENTATION('',(#{last + 1 + (at + 1) % n}),$);\n"
        for at in range(n)
    )


def _damaged(good: str, chance: random.Random) -> bytes:
    """Return a model with some bytes changed, most of them in its data."""
    content = bytearray(good.encode())
    for _ in range(chance.choice((1, 2, 5, 20))):
        at = chance.randrange(len(content))
        way = chance.randrange(4)
        if way == 0:
            content[at] = chance.randrange(256)
        elif way == 1:
            del content[at : at + chance.randrange(200)]
        elif way == 2:
            content[at:at] = content[at : at + chance.randrange(200)]
        else:
            digits = re.compile(rb"\d+").search(content, at)
            if digits:
                content[digits.start() : digits.end()] = b"%d" % chance.randrange(400)
    return bytes(content)

"""Malformed models, made with the library of the extra ``step``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tests.cad.step_models import _moved as moved
from tests.cad.step_models import _rod as rod
from tests.cad.step_models import _without as without
from tests.cad.step_models import block, written

Z = (0, 0, 1)
HOSTILE_NAMES = (
    "quotes ' and \" and ''",
    "two\nlines\r\nand\ttabs",
    "x" * 10_000,
    "\u0645\u0642\u064a\u0627\u0633 \u05de\u05d3\u05d9\u05d3\u05d4",
    "\u202eright to left",
    "../../etc/passwd\x00; $(ls)",
)
"""Names of a modeller; the last but one reverses the direction of the following text."""


def bored() -> Any:
    """Return a block of 100 by 60 by 20 with an eccentric bore of 12."""
    return without(block(), rod((20, 20, -1), Z, 6, 30))


def together(*shapes: Any) -> Any:
    """Return shapes as one compound without a body."""
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    compound, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(compound)
    for one in shapes:
        builder.Add(compound, one)
    return compound


def mirrored(shape: Any) -> Any:
    """Return a shape as a mirror at x = 0 shows it."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf

    motion = gp_Trsf()
    motion.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(1, 0, 0)))
    return BRepBuilderAPI_Transform(shape, motion, True).Shape()


def scaled(shape: Any, factor: float) -> Any:
    """Return a shape that is larger by a factor."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Pnt, gp_Trsf

    motion = gp_Trsf()
    motion.SetScale(gp_Pnt(0, 0, 0), factor)
    return BRepBuilderAPI_Transform(shape, motion, True).Shape()


def shell(shape: Any) -> Any:
    """Return the faces of a shape as a shell that bounds no solid."""
    import OCP.TopAbs as TopAbs
    from OCP.TopExp import TopExp_Explorer

    return TopExp_Explorer(shape, TopAbs.TopAbs_SHELL).Current()


def open_box() -> Any:
    """Return five faces of a block, sewn together."""
    import OCP.TopAbs as TopAbs
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
    from OCP.TopExp import TopExp_Explorer

    sewing = BRepBuilderAPI_Sewing()
    faces = TopExp_Explorer(block(), TopAbs.TopAbs_FACE)
    for _ in range(5):
        sewing.Add(faces.Current())
        faces.Next()
    sewing.Perform()
    return sewing.SewedShape()


def two_solids(gap: float) -> Any:
    """Return two bored blocks of one file, ``gap`` mm apart; their bores have one axis."""
    one = without(block(), rod((-1, 30, 10), (1, 0, 0), 6, 102))
    return together(one, moved(one, 100.0 + gap, 0.0, 0.0))


def named(path: Path, name: str) -> Path:
    """Write a bored block that is called so, as all of its faces are."""
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Writer
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopAbs import TopAbs_FACE
    from OCP.TopExp import TopExp_Explorer
    from OCP.XCAFDoc import XCAFDoc_DocumentTool

    def static(owner: Any, word: str) -> Any:
        return getattr(owner, f"{word}_s", None) or getattr(owner, word)

    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    shapes = static(XCAFDoc_DocumentTool, "ShapeTool")(document.Main())
    part = bored()
    body = shapes.AddShape(part, False)
    set_name, word = static(TDataStd_Name, "Set"), TCollection_ExtendedString(name, True)
    set_name(body, word)
    faces = TopExp_Explorer(part, TopAbs_FACE)
    while faces.More():
        set_name(shapes.AddSubShape(body, faces.Current()), word)
        faces.Next()
    writer = STEPCAFControl_Writer()
    static(Interface_Static, "SetIVal")("write.stepcaf.subshapes.name", 1)
    writer.SetNameMode(True)
    writer.Transfer(document)
    writer.Write(str(path))
    return path


def in_metres(path: Path) -> Path:
    """Write a bored block in metres."""
    return written(path, bored(), "M")


def put_by_operator(path: Path, shape: Any, scale: str, axis3: str, x: float = 0.0) -> Path:
    """Write a model whose body is placed by an operator that can scale and mirror."""
    text = written(path, shape).read_text(encoding="ascii")
    old = re.search(
        r"#(\d+) = ADVANCED_BREP_SHAPE_REPRESENTATION\('',\(#(\d+),#(\d+)\),#(\d+)\);", text
    )
    assert old is not None
    whole, axes, body, context = old.groups()
    kind, last = "ADVANCED_BREP_SHAPE_REPRESENTATION", f"#{context})"
    new = (
        f"#{whole} = {kind}('',(#{axes},#90001),{last};\n"
        "#90001 = MAPPED_ITEM('',#90002,#90003);\n"
        f"#90002 = REPRESENTATION_MAP(#{axes},#90004);\n"
        f"#90004 = {kind}('',(#{axes},#{body}),{last};\n"
        "#90003 = CARTESIAN_TRANSFORMATION_OPERATOR_3D("
        f"'','','',#90005,#90006,#90007,{scale},{axis3 and '#90008'});\n"
        "#90005 = DIRECTION('',(1.,0.,0.));\n#90006 = DIRECTION('',(0.,1.,0.));\n"
        f"#90007 = CARTESIAN_POINT('',({x:.1f},0.,0.));\n#90008 = DIRECTION('',({axis3}));"
    )
    path.write_text(text.replace(old.group(), new), encoding="ascii")
    return path


def assembled(path: Path, count: int, links: Sequence[tuple[int, int]]) -> Path:
    """Write a bored block, product 0, and further products that contain each other.

    Parameters
    ----------
    count
        Number of products in addition to the block.
    links
        Pairs of product numbers: container and content.
    """
    text = written(path, bored()).read_text(encoding="ascii")

    def number(pattern: str) -> str:
        found = re.search(pattern, text)
        assert found is not None, pattern
        return found[1]

    context = number(r"#(\d+) = PRODUCT_CONTEXT\(")
    design = number(r"#(\d+) = PRODUCT_DEFINITION_CONTEXT\(")
    shape = r"#(\d+) = ADVANCED_BREP_SHAPE_REPRESENTATION"
    axes = number(r"ADVANCED_BREP_SHAPE_REPRESENTATION\('',\(#(\d+),")
    units = number(r"ADVANCED_BREP_SHAPE_REPRESENTATION\('',\([#0-9,]*\),#(\d+)\)")
    definitions, shapes = [number(r"#(\d+) = PRODUCT_DEFINITION\('")], [number(shape)]
    more = []
    for one in range(1, count + 1):
        n = 1_000_000 + 10 * one
        definitions.append(str(n + 2))
        shapes.append(str(n + 4))
        more.append(
            f"#{n}=PRODUCT('P{one}','P{one}','',(#{context}));\n"
            f"#{n + 1}=PRODUCT_DEFINITION_FORMATION('','',#{n});\n"
            f"#{n + 2}=PRODUCT_DEFINITION('design','',#{n + 1},#{design});\n"
            f"#{n + 3}=PRODUCT_DEFINITION_SHAPE('','',#{n + 2});\n"
            f"#{n + 4}=SHAPE_REPRESENTATION('',(#{axes}),#{units});\n"
            f"#{n + 5}=SHAPE_DEFINITION_REPRESENTATION(#{n + 3},#{n + 4});\n"
        )
    for place, (child, parent) in enumerate(links):
        n = 2_000_000 + 10 * place
        more.append(
            f"#{n}=NEXT_ASSEMBLY_USAGE_OCCURRENCE('{place}','','',#{definitions[parent]},"
            f"#{definitions[child]},$);\n"
            f"#{n + 1}=PRODUCT_DEFINITION_SHAPE('','',#{n});\n"
            f"#{n + 2}=ITEM_DEFINED_TRANSFORMATION('','',#{axes},#{axes});\n"
            f"#{n + 3}=(REPRESENTATION_RELATIONSHIP('','',#{shapes[child]},#{shapes[parent]})"
            f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION(#{n + 2})"
            "SHAPE_REPRESENTATION_RELATIONSHIP());\n"
            f"#{n + 4}=CONTEXT_DEPENDENT_SHAPE_REPRESENTATION(#{n + 3},#{n + 1});\n"
        )
    body, end = text.rsplit("ENDSEC;", 1)
    path.write_text(f"{body}{''.join(more)}ENDSEC;{end}", encoding="ascii")
    return path


def in_nanometres(path: Path) -> Path:
    """Write a bored block of 100 nm."""
    text = written(path, bored()).read_text(encoding="ascii")
    path.write_text(text.replace(".MILLI.,.METRE.", ".NANO.,.METRE."), encoding="ascii")
    return path


def with_open_outlines(source: Path, path: Path) -> Path:
    """Write a file again with every loop of several edges cut to its first one."""
    text = source.read_text(encoding="ascii")
    cut, count = re.subn(r"(EDGE_LOOP\(\s*'[^']*',\s*\(\s*#\d+)\s*(?:,\s*#\d+\s*)+\)", r"\1)", text)
    assert count
    path.write_text(cut, encoding="ascii")
    return path

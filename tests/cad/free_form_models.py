"""Models with free-form faces, made with the library of the extra ``step``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ocmm_core.part_model import SplineSurface
from tests.cad.step_models import written
from tests.core.part_model.model_faces import FREE_FORMS, whole_face


def under(spline: SplineSurface, low: tuple[float, float, float], size: tuple[float, ...]) -> Any:
    """Return a box with a free-form top, limited to the part of the box below it."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakePrism
    from OCP.gp import gp_Pnt, gp_Vec

    column = BRepPrimAPI_MakePrism(whole_face(spline), gp_Vec(0, 0, -80)).Shape()
    return BRepAlgoAPI_Common(column, BRepPrimAPI_MakeBox(gp_Pnt(*low), *size).Shape()).Shape()


def wavy_block() -> Any:
    """Return a block of 70 by 70 mm with five planes and a wavy top."""
    return under(FREE_FORMS["waves"](), (-35, -35, -25), (70, 70, 50))


def uneven_block() -> Any:
    """Return a block with a rational top of two degrees."""
    return under(FREE_FORMS["rational"](), (3, 3, -25), (54, 29, 50))


def drilled_block() -> Any:
    """Return the wavy block with a hole of 16 mm through its top."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    hole = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(5, -3, -30), gp_Dir(0, 0, 1)), 8.0, 60.0).Shape()
    return BRepAlgoAPI_Cut(wavy_block(), hole).Shape()


FREE_FORM_MODELS: dict[str, Callable[[], Any]] = {
    "wavy": wavy_block, "uneven": uneven_block, "drilled": drilled_block,
}  # fmt: skip


def written_model(folder: Path, name: str) -> Path:
    """Return the file of a model."""
    return written(folder / f"{name}.step", FREE_FORM_MODELS[name]())

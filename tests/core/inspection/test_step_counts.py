"""What surfaces a model has, counted by hand or in its text, is what it offers.

All of it needs the extra ``step``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from ocmm_core.inspection.step import offers_of, read_model
from tests.core.inspection.more_step_models import MORE
from tests.core.inspection.step_models import off_mm, written
from tests.host import needs_package

OFF_MM = 0.05
KINDS = ("Plane", "Cylinder", "Cone", "Sphere", "Torus")
BALL_MM = 6.0
IN_TEXT = {
    "PLANE": "Plane", "CYLINDRICAL_SURFACE": "Cylinder", "CONICAL_SURFACE": "Cone",
    "SPHERICAL_SURFACE": "Sphere", "TOROIDAL_SURFACE": "Torus",
}  # fmt: skip


@pytest.mark.parametrize("name", MORE)
def test_each_surface_counted_by_hand_is_offered_once(
    name: str, tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    needs_package("OCP", "the extra 'step'")
    make, expected = MORE[name]
    path = written(tmp_path / "model.step", make())
    model = read_model(path, BALL_MM)
    offers = offers_of(model)
    counts = Counter(offer.feature.shape.value for offer in offers)
    assert tuple(counts[kind] for kind in KINDS) == expected
    faces = [number for offer in offers for number in offer.faces]
    assert len(faces) == len(set(faces))
    targets = [target for one in model.features for target in one.targets]
    off = off_mm(path, targets)
    record_property(f"{name}: targets off", f"{(off > OFF_MM).sum()} of {len(off)}")
    assert off.max() <= OFF_MM
    assert all(offer.against for offer in offers if not offer.feature.targets)


def test_the_walls_of_a_slit_narrower_than_the_ball_are_left_out_with_the_other_wall(
    tmp_path: Path,
) -> None:
    needs_package("OCP", "the extra 'step'")
    path = written(tmp_path / "model.step", MORE["slit"][0]())
    model = read_model(path, BALL_MM)
    walls = [one for one in model.left_out if abs(one.feature.direction[0]) == 1.0]
    assert sorted(round(one.feature.point[0], 6) for one in walls) == [47.0, 52.0]
    (first, second) = walls
    assert first.why == f"the ball would touch face {second.faces[0]}"
    assert second.why == f"the ball would touch face {first.faces[0]}"
    # A smaller one has room.
    small = read_model(path, 3.0)
    assert {47.0, 52.0} <= {round(one.point[0], 6) for one in small.features}


@pytest.mark.parametrize("name", ["ctc_01_asme1_ap242-e1", "ftc_07_asme1_ap242-e2"])
def test_every_face_in_the_text_of_a_model_is_offered_once(name: str, reference: Path) -> None:
    needs_package("OCP", "the extra 'step'")
    path = reference / "step" / f"nist_{name}.stp"
    text = re.sub(r"\s+", "", path.read_text(encoding="utf-8", errors="replace"))
    surfaces = dict(re.findall(rf"#(\d+)=({'|'.join(IN_TEXT)})\(", text))
    of_face = dict(re.findall(r"#(\d+)=ADVANCED_FACE\('[^']*',\([^)]*\),#(\d+),", text))
    # Those of open shells bound no material: construction geometry.
    shells = re.findall(r"=CLOSED_SHELL\('[^']*',\(([^)]*)\)\)", text)
    used = [of_face[face] for shell in shells for face in re.findall(r"#(\d+)", shell)]
    in_text = Counter(IN_TEXT[surfaces[number]] for number in used if number in surfaces)
    offered: Counter[str] = Counter()
    for offer in offers_of(read_model(path, BALL_MM)):
        offered[offer.feature.shape.value] += len(offer.faces)
    assert offered == in_text

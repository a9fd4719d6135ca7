"""A model offers the surfaces counted by hand or in its text.

Needs the extra ``step``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from ocmm_cad.step import NOT_EXACT, offers_of, read_model
from tests.cad.more_step_models import MORE
from tests.cad.nist_models import nist_model, path_of
from tests.cad.step_models import off_mm, written
from tests.cad.step_text import Surface, surfaces_in_text
from tests.host import needs_package

pytestmark = pytest.mark.usefixtures("kept_readers")

OFF_MM = 0.05
KINDS = ("Plane", "Cylinder", "Cone", "Sphere", "Torus")
BALL_MM = 6.0
COUNTED = ("Plane", "Cylinder", "Cone")
BY_HAND: dict[str, tuple[tuple[int, int], ...]] = {
    # Surfaces and their faces: planes, cylinders, cones. Counted in the text of each file, by the
    # rule that `step_text` states; not with the import, and not with its library.
    "ctc_01_asme1_ap203": ((80, 80), (57, 57), (2, 2)),
    "ctc_01_asme1_ap242-e1": ((56, 56), (47, 57), (2, 4)),
    "ctc_03_asme1_ap242-e2": ((62, 62), (43, 58), (0, 0)),
    "ftc_06_asme1_ap242-e2": ((71, 71), (58, 88), (4, 8)),
    "ftc_07_asme1_ap242-e2": ((73, 73), (106, 133), (28, 36)),
}
FACES = {
    # All kinds, in closed shells; ftc_07 has two more in open shells (construction geometry).
    "ctc_01_asme1_ap203": 139,
    "ctc_01_asme1_ap242-e1": 117,
    "ctc_03_asme1_ap242-e2": 120,
    "ftc_06_asme1_ap242-e2": 187,
    "ftc_07_asme1_ap242-e2": 304,
}


def _table(surfaces: Sequence[Surface]) -> tuple[tuple[int, int], ...]:
    """Return the number of surfaces of each kind, and the number of their faces."""
    faces = [[len(faces) for kind, faces in surfaces if kind == one] for one in COUNTED]
    return tuple((len(of_kind), sum(of_kind)) for of_kind in faces)


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


@pytest.mark.parametrize("name", BY_HAND)
def test_the_table_made_by_hand_is_what_the_text_says(name: str, reference: Path) -> None:
    in_text = surfaces_in_text(path_of(reference, name))
    assert _table(in_text) == BY_HAND[name]


@pytest.mark.slow
@pytest.mark.parametrize("name", BY_HAND)
def test_every_face_of_the_table_is_in_one_offer(
    name: str, reference: Path, record_property: Callable[[str, object], None]
) -> None:
    path, model = path_of(reference, name), nist_model(reference, name)
    offers = offers_of(model)
    offered = [(offer.kind, frozenset(offer.faces)) for offer in offers if offer.kind in COUNTED]
    assert _table(offered) == BY_HAND[name]
    # Face for face: numbers count the faces as the shell of the file names them.
    in_text = surfaces_in_text(path)
    assert Counter(offered) == Counter(in_text)
    record_property(f"{name}: of the table", f"{len(offered)} of {len(in_text)} offered")
    # No face is offered twice, and faces of other kinds are reported.
    numbers = [number for offer in offers for number in offer.faces]
    assert len(numbers) == len(set(numbers))
    others = {kind: count for kind, count in model.others.items() if kind not in NOT_EXACT}
    assert len(numbers) + sum(others.values()) == FACES[name]

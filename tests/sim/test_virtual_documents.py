"""The documents shipped with the virtual rig are valid, and faults of others are named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ocmm_core.camera import distort, load_rig, project
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import load_plan
from ocmm_core.tracking import load_probe, nearest_ambiguity
from ocmm_sim.scene import Part, load_part

KINDS = {
    "Plane": "plane", "Sphere": "sphere", "Circle": "bore", "Cylinder": "cylinder",
    "Line": "line", "Point": "point",
}  # fmt: skip


@pytest.mark.parametrize(("name", "baseline"), [("thesis", 330.0), ("recommended", 600.0)])
def test_rigs_are_as_the_thesis_describes_them(name: str, baseline: float) -> None:
    rig = load_rig(resource("rigs", f"{name}.toml"))
    left, right = rig.cameras
    np.testing.assert_allclose(right.centre_world - left.centre_world, [baseline, 0, 0], atol=1e-9)
    for camera in rig.cameras:
        # The camera is directed at the origin; columns go right and rows go down.
        np.testing.assert_allclose(project(camera, np.zeros(3)), [1023.5, 1023.5], atol=1e-6)
        u, v = project(camera, np.array([[10.0, 0.0, 0.0], [0.0, 0.0, 10.0]])) - 1023.5
        assert u[0] > 15.0
        assert v[1] < -15.0
        edge = np.array([[12.288, 0.0], [-12.288, 0.0], [0.0, 12.288], [0.0, -12.288]])
        mean = np.mean(np.linalg.norm(distort(camera, edge), axis=1)) / 12.288 - 1.0
        assert mean == pytest.approx(-0.015, abs=2e-5)
    assert np.hypot(rig.noise.white_px / 10.0, rig.noise.pattern_px) == pytest.approx(
        0.0105, abs=1e-4
    )


def test_a_rectangle_needs_its_orientation_rules(tmp_path: Path) -> None:
    shipped = resource("probes", "thesis.toml")
    assert load_probe(shipped).n_leds == 4
    bare = tmp_path / "bare.toml"
    bare.write_text(shipped.read_text("utf-8").split("[[orientation_rules]]")[0], "utf-8")
    with pytest.raises(InputError, match=r"fit the body to 0\.000 mm") as refused:
        load_probe(bare)
    assert refused.value.code == "probe.ambiguous"


def test_the_standard_probe_has_labels_that_cannot_be_confused() -> None:
    body = load_probe(resource("probes", "standard.toml"))
    nearest = nearest_ambiguity(body)
    assert nearest is not None
    assert nearest.residual_mm > 5.0
    assert set(np.abs(body.leds_probe[:, 1])) == {30.0}


@pytest.mark.parametrize("name", ["demo", "quick"])
def test_plans_ask_for_features_that_the_part_has_where_it_has_them(
    demo_part: Part, name: str
) -> None:
    plan = load_plan(resource("plans", f"{name}.toml"))
    truth = demo_part.features_part()
    assert plan.part == demo_part.name
    for feature in plan.features:
        true = truth[feature.name]
        assert KINDS[feature.shape.value] == true.kind
        assert true.diameter == pytest.approx(feature.diameter, abs=0.05)
        np.testing.assert_allclose(true.direction, feature.direction, atol=1e-9)
        offset = np.array(feature.point) - true.point
        if true.kind in ("plane", "line", "cylinder"):
            # Any point of the element will do.
            along = offset @ true.direction
            offset = offset - along * true.direction if true.kind != "plane" else along
        assert np.linalg.norm(offset) < 0.05
    assert sum(feature.points for feature in plan.features) == {"demo": 91, "quick": 14}[name]


def test_the_demo_plan_has_every_shape_once() -> None:
    plan = load_plan(resource("plans", "demo.toml"))
    assert {feature.shape.value for feature in plan.features} == set(KINDS)


def test_the_part_is_not_aligned_with_the_world(demo_part: Part) -> None:
    features = demo_part.features_world()
    line = features["BORE_B"].point - features["BORE_A"].point
    assert abs(np.degrees(np.arctan2(line[1], line[0]))) > 1.0


PLANE = """
[[features]]
kind = "plane"
name = "BED"
point = [0.0, 0.0, 0.0]
direction = [0.0, 0.0, 1.0]
along = [1.0, 0.0, 0.0]
areas = [[-10.0, -10.0, 10.0, 10.0]]
"""
CONE = """
[[features]]
kind = "cone"
name = "CONE"
point = [0.0, 0.0, 0.0]
direction = [0.0, 0.0, 1.0]
diameter = 20.0
top_diameter = 8.0
height = 10.0
"""
LINE = """
[[features]]
kind = "line"
name = "LINE"
point = [0.0, 0.0, 0.0]
direction = [1.0, 0.0, 0.0]
normal = [0.0, -1.0, 0.0]
length = 10.0
"""
GOOD = f"""schema = "ocmm.part/1"
unit = "mm"
name = "PART"
[pose]
translation = [0.0, 0.0, 0.0]
rotation_vector = [0.0, 0.0, 0.0]
{PLANE}{CONE}{LINE}"""


def write(folder: Path, text: str) -> Path:
    path = folder / "part.toml"
    path.write_text(text, "utf-8")
    return path


def test_a_good_part_is_taken(tmp_path: Path) -> None:
    assert len(load_part(write(tmp_path, GOOD)).artefacts) == 3


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("ocmm.part/1", "ocmm.plan/1", "field 'schema' is 'ocmm.plan/1'"),
        ('unit = "mm"', 'unit = "inch"', "field 'unit' is 'inch'"),
        ("[pose]", "[pose", "not valid TOML"),
        ('name = "PART"', "", "missing required field `name`"),
        ("rotation_vector = [0.0, 0.0, 0.0]", "", "missing required field `rotation_vector`"),
        (PLANE + CONE + LINE, "features = []", "unknown field `features`"),
        ('kind = "cone"', 'kind = "gear"', "Invalid value 'gear'"),
        ('kind = "cone"', "", "missing required field `kind`"),
        ("height = 10.0", 'height = "10"', "Expected `float`, got `str`"),
        ("height = 10.0", "height = 0.0", r"'features\[1\].height' is 0.0"),
        ("height = 10.0", "height = nan", r"'features\[1\].height' is nan"),
        ("height = 10.0", "colour = 1", "unknown field `colour`"),
        ("\ndiameter = 20.0", "\ndiameter = -20.0", r"'features\[1\].diameter' is -20.0"),
        ("top_diameter = 8.0", "top_diameter = 20.0", "is not smaller than 'diameter'"),
        ('name = "CONE"', 'name = "BED"', r"'features\[1\].name' repeats the name 'BED'"),
        ("direction = [1.0, 0.0, 0.0]", "direction = [0.0, 0.0, 0.0]", "is a zero vector"),
        ("along = [1.0, 0.0, 0.0]", "along = [1.0, 0.0, 0.5]", r"\.along' is not perpendicular"),
        ("normal = [0.0, -1.0, 0.0]", "normal = [1.0, -1.0, 0.0]", r"\.normal' is not perp"),
        ("areas = [[-10.0, -10.0, 10.0, 10.0]]", "areas = []", r"\.areas' is empty"),
        ("[[-10.0, -10.0, 10.0, 10.0]]", "[[1.0, 0.0, 1.0, 1.0]]", "which encloses no area"),
        ("point = [0.0, 0.0, 0.0]", "point = [0.0, 0.0]", "Expected `array` of length 3"),
    ],
)
def test_a_bad_part_document_is_refused_in_one_sentence(
    tmp_path: Path, old: str, new: str, sentence: str
) -> None:
    assert old in GOOD
    path = write(tmp_path, GOOD.replace(old, new, 1))
    with pytest.raises(InputError, match=sentence) as refused:
        load_part(path)
    assert str(path) in refused.value.what
    assert refused.value.what.endswith(".")
    assert refused.value.remedy.endswith(".")
    assert "\n" not in refused.value.what


def test_a_part_without_features_is_refused(tmp_path: Path) -> None:
    text = GOOD.replace(PLANE + CONE + LINE, "").replace("[pose]", "features = []\n[pose]")
    with pytest.raises(InputError, match="'features' is empty"):
        load_part(write(tmp_path, text))


def test_a_missing_part_document_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="file not found"):
        load_part(tmp_path / "nowhere.toml")

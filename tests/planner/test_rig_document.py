"""The document of a rig plan, catalogues, and the sheet with its sentences."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.wording import Speech
from ocmm_planner import (
    evaluate_plan,
    load_rig_plan,
    map_from_above,
    read_sheet,
    sheet_sentences,
    shopping_list,
)
from tests.planner.rig_scenes import changed, given_plan

TEXT = resource("rig_plans", "thesis.toml").read_text("utf-8")


def written(folder: Path, *changes: tuple[str, str], more: str = "") -> Path:
    """Return a plan with changed text, next to the resources that it names."""
    text = TEXT.replace("../probes", str(resource("probes")))
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    path = folder / "plan.toml"
    path.write_text(text + more, "utf-8")
    return path


BOX = "\n[[keep_out]]\nname = 'post'\nmin = {low}\nmax = {high}\n"


@pytest.mark.parametrize(
    ("change", "more", "said"),
    [
        (("stop = 8.0", "stop = 80.0"), "", "cameras[0].stop"),
        (("smart-2048", "smart-1"), "", "no catalogue contains 'smart-1'"),
        (("frames = 100", "frames = 0"), "", "$.measuring.frames"),
        (("tilt_deg = [30.0", "tilt_deg = [-3.0"), "", "$.attitudes.tilt_deg"),
        (("length = 300.0", "length = 500.0"), "", "length"),
        (("length = 300.0", "length = 300.0\nfocus = 3"), "", "unknown field"),
        (('name = "right"', 'name = "left"'), "", "cameras[0].name"),
        (("nodes = [9, 4, 9]", "nodes = [9, 0, 9]"), "", "$.nodes"),
        (("volume_min = [-200.0, -75.0", "volume_min = [-200.0, 75.0"), "", "volume_max"),
        (("min = [-500.0", "min = [-50.0"), "", "cameras[0].place"),
        (("centre = [-165.0, -1000.0", "centre = [0.0, 0.0"), "", "cameras[0].target"),
        (("X to", "X to"), BOX.format(low="[-170, -1010, -5]", high="[-160, -990, 5]"),
         "cameras[0].centre"),
        (("X to", "X to"), BOX.format(low="[-300, -300, -300]", high="[300, 300, 300]"), "nodes"),
    ],
)  # fmt: skip
def test_refuses_what_contradicts(
    change: tuple[str, str], more: str, said: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as refused:
        load_rig_plan(written(tmp_path, change, more=more))
    assert said in refused.value.what


def test_a_catalogue_of_ones_own(tmp_path: Path) -> None:
    own = resource("catalogue", "smart.toml").read_text("utf-8").replace('"smart-2048"', '"mine"')
    own = own.replace('"25mm-thesis"', '"my lens"').replace("0.012", "0.006")
    (tmp_path / "own.toml").write_text(own, "utf-8")
    path = written(
        tmp_path, ('camera = "smart-2048"', 'camera = "mine"'),
        ("length = 300.0", 'length = 300.0\ncatalogue = ["own.toml"]'),
    )  # fmt: skip
    assert load_rig_plan(path).cameras[0].pitch == 0.006
    (tmp_path / "own.toml").write_text(own.replace('"mine"', '"smart-2048"'), "utf-8")
    with pytest.raises(InputError, match="given twice: smart-2048"):
        load_rig_plan(path)


def test_the_example_of_the_guide_is_a_plan(tmp_path: Path) -> None:
    guide = Path(__file__).parents[2] / "docs" / "technician" / "planning_a_rig.md"
    text = guide.read_text("utf-8").partition("```toml\n")[2].partition("```")[0]
    text = text.replace("my_cameras.toml", str(tmp_path / "my_cameras.toml"))
    text = text.replace('"standard.toml"', f'"{resource("probes", "standard.toml")}"')
    (tmp_path / "my_cameras.toml").write_text('schema = "ocmm.rig_catalogue/1"\nunit = "mm"\n')
    head, camera = text.split("[[cameras]]")
    right = camera.replace("left", "right").replace("[-200.0, -1300.0", "[600.0, -1300.0")
    (tmp_path / "plan.toml").write_text("[[cameras]]".join([head, camera, right]), "utf-8")
    plan = changed(load_rig_plan(tmp_path / "plan.toml"), nodes=(3, 3, 3))
    sheet = evaluate_plan(plan, seed=1, evaluations=0)
    # The chuck and the end of the bar away from the left camera cost the others.
    assert sheet.best.measurable >= 20
    assert sheet.best.measurable + sum(sheet.best.without.values()) == sheet.best.nodes == 27


def test_looks_where_it_is_aimed(tmp_path: Path) -> None:
    plan = load_rig_plan(written(tmp_path, ("stop = 8.0", "stop = 8.0\nroll_deg = 90.0")))
    left = plan.rig(plan.places).cameras[0]
    upwards = left.T_camera_from_world.apply(np.array([0.0, 0.0, 100.0]))
    assert left.centre_world == pytest.approx([-165.0, -1000.0, 0.0])
    # The target is on the axis; a turn about it moves up to the side.
    assert left.T_camera_from_world.apply(np.zeros(3))[:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert abs(upwards[0]) == pytest.approx(100.0)
    assert upwards[1] == pytest.approx(0.0, abs=1e-9)
    given = given_plan()
    above = given.places.copy()
    above[0, :3] = [0.0, 0.0, 1000.0]
    assert np.linalg.det(given.rig(above).cameras[0].T_camera_from_world.rotation) == (
        pytest.approx(1.0)
    )


def test_sheet_survives_json_and_speaks_german(
    tmp_path: Path, record_property: Callable[[str, object], None]
) -> None:
    plan = changed(given_plan(), nodes=(3, 2, 3))
    sheet = evaluate_plan(plan, seed=1, evaluations=1)
    path = tmp_path / "rig.json"
    path.write_bytes(msgspec.json.encode(sheet))
    assert read_sheet(path) == sheet
    path.write_text("{}", "utf-8")
    with pytest.raises(InputError):
        read_sheet(path)
    said, speech = sheet_sentences(sheet), Speech("de")
    untranslated = [one for one in said if speech.text(one) == one]
    assert not untranslated
    assert shopping_list(sheet)[0] == "2 x OCMM smart camera, 2048 x 2048"
    # The nodes in the sheet are those of its figures.
    worst = max(math.inf if one is None else one for one in sheet.u_um)
    assert sheet.best.worst_um == pytest.approx(worst, abs=0.001)
    top = map_from_above(sheet)
    assert top.space_um.shape == (2, 3)
    assert top.space_um.max() == pytest.approx(worst, abs=0.001)


def test_link_is_shared_and_too_fast_is_said() -> None:
    plan = given_plan()
    measuring = msgspec.structs.replace(plan.document.measuring, rate_hz=100_000.0)
    plan = changed(plan, nodes=(2, 2, 2), measuring=measuring)
    sheet = evaluate_plan(plan, seed=1, evaluations=0)
    # Two cameras of 100 bytes on one link of 12 MB/s.
    assert sheet.cameras[0].load == pytest.approx(1e5 * 2 * 100 / 12e6)
    assert sheet.cameras[0].highest_rate_hz == 8000.0
    assert any(one.startswith("TOO FAST") for one in sheet_sentences(sheet))

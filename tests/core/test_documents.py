"""Every fault of a document is one sentence with file and field."""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.camera import load_rig
from ocmm_core.documents import (
    Document,
    digest,
    files_of_folder,
    find_files,
    load_document,
    write_atomic,
)
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import load_plan
from ocmm_core.tracking import load_probe

PLAN = """
schema = "ocmm.plan/1"
unit = "mm"
name = "PLAN"
part = "PART"

[alignment]
primary = "TOP"
secondary = ["A", "B"]
origin = "A"

[[features]]
name = "TOP"
shape = "Plane"
points = 4
point = [0.0, 0.0, 0.0]
direction = [0.0, 0.0, 1.0]

[[features]]
name = "A"
shape = "Circle"
points = 8
point = [0.0, 0.0, 0.0]
diameter = 12.0
side = "inner"
projection = "TOP"

[[features]]
name = "B"
shape = "Sphere"
points = 9
point = [40.0, 0.0, 0.0]
diameter = 20.0

[[characteristics]]
name = "A diameter"
kind = "diameter"
features = ["A"]
nominal = 12.0
lower = -0.05
upper = 0.05

[[characteristics]]
name = "A to B"
kind = "distance"
features = ["A", "B"]
nominal = 40.0
lower = -0.05
upper = 0.05

[[characteristics]]
name = "B x"
kind = "coordinate"
features = ["B"]
axis = "x"
nominal = 40.0
lower = -0.05
upper = 0.05

[[characteristics]]
name = "TOP form"
kind = "form"
features = ["TOP"]
nominal = 0.0
lower = 0.0
upper = 0.05
"""

RIG = """
schema = "ocmm.rig/1"
unit = "mm"
name = "bench"
frame_rate_hz = 8000
volume_min = [-100.0, -100.0, 900.0]
volume_max = [100.0, 100.0, 1100.0]

[noise]
white_px = 3e-2
pattern_px = 1e-2
pattern_length_px = 20.0

[calibration]
method = "known points"
points = 200
volume_min = [-100.0, -100.0, 900.0]
volume_max = [100.0, 100.0, 1100.0]
spot_sigma_px = 1e-2
reference_sigma = 2e-3

[[cameras]]
name = "left"
serial = 1001
alias = 1
width_px = 2048
height_px = 2048
pitch = 12e-3
focal = 25.0
aspect = 1.0
u0_px = 1023.5
v0_px = 1023.5
k1 = -1.0e-4
k2 = 0.0
p1 = 0.0
p2 = 0.0
centre = [-165.0, 0.0, 0.0]
rotation_vector = [0.0, 0.0, 0.0]

[[cameras]]
name = "right"
serial = 1002
alias = 2
width_px = 2048
height_px = 2048
pitch = 12e-3
focal = 25.0
aspect = 1.0
u0_px = 1023.5
v0_px = 1023.5
k1 = -1.0e-4
k2 = 0.0
p1 = 0.0
p2 = 0.0
centre = [165.0, 0.0, 0.0]
rotation_vector = [0.0, 0.0, 0.0]
"""

PROBE = """
schema = "ocmm.probe/1"
unit = "mm"
name = "probe"
tip = [0.0, 0.0, 0.0]
tip_diameter = 3.0
tip_diameter_sigma = 0.001
tip_sigma = [0.002, 0.002, 0.002]
led_sigma = 0.002
emission_half_angle_deg = 60.0

[[leds]]
position = [30.0, -30.0, 228.0]
direction = [0.0, -1.0, 0.0]

[[leds]]
position = [55.0, 30.0, 118.0]
direction = [0.0, -1.0, 0.0]

[[leds]]
position = [-40.0, -30.0, 163.0]
direction = [0.0, -1.0, 0.0]

[[leds]]
position = [-5.0, 30.0, 128.0]
direction = [0.0, -1.0, 0.0]
"""

RECTANGLE = """
schema = "ocmm.probe/1"
unit = "mm"
name = "rectangle"
tip = [0.0, 0.0, 0.0]
tip_diameter = 3.0
tip_diameter_sigma = 0.001
tip_sigma = [0.002, 0.002, 0.002]
led_sigma = 0.002
emission_half_angle_deg = 60.0
leds = [
  {position = [-40.0, 0.0, 100.0], direction = [0.0, -1.0, 0.0]},
  {position = [40.0, 0.0, 100.0], direction = [0.0, -1.0, 0.0]},
  {position = [40.0, 0.0, 220.0], direction = [0.0, -1.0, 0.0]},
  {position = [-40.0, 0.0, 220.0], direction = [0.0, -1.0, 0.0]},
]
"""

LOADERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "plan": (PLAN, load_plan),
    "rig": (RIG, load_rig),
    "probe": (PROBE, load_probe),
}


def without(text: str, start: str, end: str) -> str:
    """Return ``text`` without what lies from ``start`` up to, not including, ``end``."""
    first = text.index(start)
    return text[:first] + text[text.index(end, first) :]


def edited(text: str, old: str, new: str) -> str:
    """Return ``text`` with the first ``old``, which must be there, replaced."""
    assert old in text
    return text.replace(old, new, 1)


def refusal(path: Path, content: str | bytes, load: Callable[[Path], object]) -> InputError:
    """Return the error with which the document is refused, a sentence with its file."""
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(InputError) as caught:
        load(path)
    error = caught.value
    assert str(path) in error.what
    assert error.what.endswith(".")
    assert "\n" not in str(error)
    assert error.remedy.endswith(".")
    return error


@pytest.mark.parametrize("kind", LOADERS)
def test_the_good_document_loads(tmp_path: Path, kind: str) -> None:
    text, load = LOADERS[kind]
    path = tmp_path / "a.toml"
    path.write_text(text)
    load(path)


def test_what_is_written_is_what_is_loaded(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text(PLAN)
    plan = load_plan(path)
    assert [feature.name for feature in plan.features] == ["TOP", "A", "B"]
    assert plan.feature("B").diameter == 20.0
    with pytest.raises(KeyError):
        plan.feature("C")
    assert plan.rule == "iso14253-1"
    path.write_text(RIG)
    rig = load_rig(path)
    assert [camera.serial for camera in rig.cameras] == [1001, 1002]
    assert rig.cameras[0].centre_world == pytest.approx([-165.0, 0.0, 0.0])
    assert rig.packed().shape == (2, 21)
    assert rig.identity == digest(path) == hashlib.sha256(RIG.encode()).hexdigest()
    # A covariance: symmetric, positive, without correlation between cameras calibrated alone.
    covariance = rig.parameter_covariance
    assert np.array_equal(covariance, covariance.T)
    assert np.all(np.diag(covariance) > 0.0)
    assert not covariance[:14, 14:].any()
    path.write_text(PROBE)
    body = load_probe(path)
    assert (body.n_leds, body.tip_radius) == (4, 1.5)


@pytest.mark.parametrize("kind", LOADERS)
def test_a_file_that_cannot_be_read(tmp_path: Path, kind: str) -> None:
    load = LOADERS[kind][1]
    for path, code in (
        (tmp_path / "none.toml", "document.missing"),
        (tmp_path, "document.unreadable"),
    ):
        with pytest.raises(InputError) as caught:
            load(path)
        assert caught.value.code == code
        assert str(path) in caught.value.what


@pytest.mark.parametrize("kind", LOADERS)
@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ('schema = "ocmm.', 'schema = "other.', "document.schema"),
        ("/1", "/2", "document.schema"),
        ('unit = "mm"', 'unit = "inch"', "document.unit"),
        ('unit = "mm"', "", "document.unit"),
        ('unit = "mm"', "unit = 1", "document.unit"),
        ("name = ", "name = 7 # ", "document.field"),
        ("name = ", "colour = 7\nname = ", "document.field"),
        ('name = "', 'name = "µ\x00', "document.syntax"),
        (" 0.0", " nan", "document.not_finite"),
        (" 0.0", " -inf", "document.not_finite"),
        (" 0.0", ' "0.0"', "document.field"),
        (" 0.0", " 1" + "0" * 400, "document.field"),
        ("[0.0, 0.0, 0.0]", "[0.0, 0.0]", "document.field"),
        ("\n[", "\n[[", "document.syntax"),
        ("\n[", "\n" + "x = " + "[" * 100_000 + "\n[", "document.syntax"),
    ],
)
def test_the_common_faults(tmp_path: Path, kind: str, old: str, new: str, code: str) -> None:
    text, load = LOADERS[kind]
    if new == "\n[[":
        text = text.replace("[[", "[")
    assert refusal(tmp_path / "a.toml", edited(text, old, new), load).code == code


@pytest.mark.parametrize("kind", LOADERS)
def test_a_document_that_is_cut_off_anywhere_is_loaded_or_refused_in_words(
    tmp_path: Path, kind: str
) -> None:
    text, load = LOADERS[kind]
    path = tmp_path / "a.toml"
    for length in range(0, text.rindex("\n\n"), 7):
        path.write_text(text[:length])
        # Cut between two entries, the rest can be a smaller valid document.
        with contextlib.suppress(InputError):
            load(path)


def test_text_that_is_not_utf8_and_an_empty_file(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    assert refusal(path, PLAN.encode().replace(b"PART", b"P\xe4RT"), load_plan).code == (
        "document.encoding"
    )
    assert refusal(path, b"", load_plan).code == "document.schema"
    assert refusal(path, b"\xff\xfe\x00", load_plan).code == "document.encoding"


def test_a_number_that_is_not_finite_is_named_down_to_its_place(tmp_path: Path) -> None:
    content = edited(PLAN, "point = [40.0, 0.0, 0.0]", "point = [40.0, nan, 0.0]")
    error = refusal(tmp_path / "a.toml", content, load_plan)
    assert "'features[2].point[1]' is nan" in error.what


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name = "PLAN"', 'name = "PL\\u202eAN"', "'name' is"),
        ('part = "PART"', 'part = "-PART"', "'part' is '-PART'"),
        ('part = "PART"', 'part = ""', "'part' is ''"),
        ('name = "A"', 'name = "A\'B"', "features[1].name"),
        ('name = "A"', f'name = "{"x" * 61}"', "features[1].name"),
        ('name = "A"', 'name = "B"', "'features[2].name' repeats the name 'B'"),
        ('name = "A to B"', 'name = "=A"', "characteristics[1].name"),
        ('name = "A to B"', 'name = "B x"', "'characteristics[2].name' repeats"),
        ("points = 4", "points = 2", "'features[0].points' is 2; a plane needs 3 to 1000"),
        ("points = 9", "points = 3", "'features[2].points' is 3; a sphere needs 4"),
        ("points = 8", "points = 1001", "'features[1].points' is 1001"),
        ("direction = [0.0, 0.0, 1.0]", "direction = [0.0, 0.0, 0.0]", "features[0].direction"),
        ("diameter = 12.0", "diameter = 0.0", "'features[1].diameter' is 0.0"),
        ("diameter = 12.0", "diameter = -12.0", "'features[1].diameter' is -12.0"),
        ("points = 4", "points = 4\ndiameter = 1.0", "'features[0].diameter' is 1.0"),
        ('projection = "TOP"', 'projection = "LOW"', "'features[1].projection' names 'LOW'"),
        ('projection = "TOP"', 'projection = "B"', "'B', but needs one of: plane"),
        ("points = 9", 'points = 9\nprojection = "TOP"', "projection' is only for lines, circles"),
        ('features = ["A"]', 'features = ["A", "B"]', "a diameter needs 1"),
        ('features = ["A", "B"]', 'features = ["A"]', "a distance needs 2"),
        ('features = ["A"]', 'features = ["C"]', "names 'C', which is not a feature"),
        ('features = ["A"]', 'features = ["TOP"]', "'TOP', but needs one of: circle, sphere"),
        ('features = ["B"]', 'features = ["TOP"]', "'TOP', but needs one of: point, circle"),
        ("upper = 0.05", "upper = -0.06", "'characteristics[0].upper' is below 'lower'"),
        ('axis = "x"', "", "'characteristics[2].axis' is missing: a coordinate is x, y or z"),
        ('axis = "x"', 'axis = "w"', "characteristics[2].axis"),
        ('kind = "form"', 'kind = "form"\naxis = "z"', "'characteristics[3].axis' goes"),
        ('kind = "form"', 'kind = "ovality"', "characteristics[3].kind"),
        ('shape = "Sphere"', 'shape = "Ball"', "features[2].shape"),
        ('side = "inner"', 'side = "left"', "features[1].side"),
        ('primary = "TOP"', 'primary = "A"', "alignment.primary"),
        ('primary = "TOP"', 'primary = "LOW"', "'alignment.primary' names 'LOW'"),
        ('secondary = ["A", "B"]', 'secondary = ["A", "TOP"]', "'alignment.secondary' names 'TOP'"),
        ('secondary = ["A", "B"]', 'secondary = ["A", "A"]', "names one feature twice"),
        ('secondary = ["A", "B"]', 'secondary = ["A"]', "alignment.secondary"),
        ('origin = "A"', 'origin = "C"', "'alignment.origin' names 'C'"),
    ],
)
def test_a_plan_that_cannot_be_measured(tmp_path: Path, old: str, new: str, words: str) -> None:
    error = refusal(tmp_path / "a.toml", edited(PLAN, old, new), load_plan)
    assert words in error.what


def test_a_plan_without_features_or_without_the_frame_it_needs(tmp_path: Path) -> None:
    characteristics = PLAN[PLAN.index("[[characteristics]]") :]
    head = PLAN[: PLAN.index("[alignment]")]
    error = refusal(tmp_path / "a.toml", f"{head}\nfeatures = []\n{characteristics}", load_plan)
    assert "'features' is empty" in error.what
    no_frame = without(PLAN, "[alignment]", "[[features]]")
    error = refusal(tmp_path / "a.toml", no_frame, load_plan)
    assert "the plan has no 'alignment'" in error.what


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name = "right"', 'name = "left"', "two cameras have the name 'left'"),
        ("serial = 1002", "serial = 1001", "two cameras have the serial 1001"),
        ("alias = 2", "alias = 1", "two cameras have the alias 1"),
        ("width_px = 2048", "width_px = 0", "'cameras[0].width_px' is 0"),
        ("height_px = 2048", "height_px = -1", "'cameras[0].height_px' is -1"),
        ("pitch = 12e-3", "pitch = 0.0", "'cameras[0].pitch' is 0.0"),
        ("focal = 25.0", "focal = -25.0", "'cameras[0].focal' is -25.0"),
        ("aspect = 1.0", "aspect = 0.0", "'cameras[0].aspect' is 0.0"),
        ("serial = 1002", "serial = 0", "'cameras[1].serial' is 0"),
        ("alias = 2", "alias = 0", "'cameras[1].alias' is 0"),
        ("frame_rate_hz = 8000", "frame_rate_hz = 0", "'frame_rate_hz' is 0"),
        ("white_px = 3e-2", "white_px = 0.0", "'noise.white_px' is 0.0"),
        ("pattern_length_px = 20.0", "pattern_length_px = 0.0", "'noise.pattern_length_px'"),
        ("spot_sigma_px = 1e-2", "spot_sigma_px = 0.0", "'calibration.spot_sigma_px'"),
        ("points = 200", "points = 0", "'calibration.points' is 0"),
        ("points = 200", "points = 10", "calibration points are seen by camera 'left'"),
        ("volume_max = [100.0, 100.0, 1100.0]", "volume_max = [100.0, -100.0, 1100.0]",
         "'volume_max' is not above"),
        ("focal = 25.0", "focal = 2500.0", "calibration points are seen by camera 'left'"),
        ("rotation_vector = [0.0, 0.0, 0.0]", "rotation_vector = [3.14159, 0.0, 0.0]",
         "only 0 calibration points are seen by camera 'left'"),
        ('method = "known points"', 'method = "guess"', "calibration.method"),
    ],
)  # fmt: skip
def test_a_rig_that_cannot_be_used(tmp_path: Path, old: str, new: str, words: str) -> None:
    error = refusal(tmp_path / "a.toml", edited(RIG, old, new), load_rig)
    assert words in error.what


def test_a_rig_with_the_wrong_number_of_cameras(tmp_path: Path) -> None:
    head, left, right = RIG.partition("[[cameras]]")[0], *RIG.split("[[cameras]]")[1:]
    error = refusal(tmp_path / "a.toml", f"{head}[[cameras]]{left}", load_rig)
    assert "names 1 camera(s)" in error.what
    many = head + "".join(f"[[cameras]]{part}" for part in (left, *8 * (right, left)))
    assert "names 17 camera(s)" in refusal(tmp_path / "a.toml", many, load_rig).what


def test_a_calibration_volume_without_depth_does_not_determine_a_camera(tmp_path: Path) -> None:
    head, _, rest = RIG.partition("[calibration]")
    flat = edited(rest, "900.0]", "1000.0]")
    flat = edited(flat, "1100.0]", "1000.0]")
    error = refusal(tmp_path / "a.toml", f"{head}[calibration]{flat}", load_rig)
    assert "too flat to determine camera 'left'" in error.what


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("tip_diameter = 3.0", "tip_diameter = 0.0", "'tip_diameter' is 0.0 mm"),
        ("tip_diameter = 3.0", "tip_diameter = -3.0", "'tip_diameter' is -3.0 mm"),
        ("tip_diameter = 3.0", "tip_diameter = 3000.0", "'tip_diameter' is 3000.0 mm"),
        ("[-5.0, 30.0, 128.0]", "[-40.0, -30.0, 166.0]", "leds[2] and leds[3] are 3.00 mm apart"),
        ("[-5.0, 30.0, 128.0]", "[-5.0, 30.0, 1128.0]", "more than 1 m from the tip"),
        ("direction = [0.0, -1.0, 0.0]", "direction = [0.0, 0.0, 0.0]", "'leds[0].direction'"),
        ("emission_half_angle_deg = 60.0",
         "emission_half_angle_deg = 60.0\n[[orientation_rules]]\nprobe_axis = [0.0, 0.0, 0.0]\n"
         "world_direction = [0.0, 0.0, 1.0]",
         "'orientation_rules[0].probe_axis'"),
    ],
)  # fmt: skip
def test_a_probe_that_cannot_be_used(tmp_path: Path, old: str, new: str, words: str) -> None:
    error = refusal(tmp_path / "a.toml", edited(PROBE, old, new), load_probe)
    assert words in error.what


@pytest.mark.parametrize("count", [0, 2, 65])
def test_a_probe_with_too_few_or_too_many_leds(tmp_path: Path, count: int) -> None:
    head = PROBE.partition("[[leds]]")[0]
    leds = [
        f"[[leds]]\nposition = [{40.0 * i}, {i * i}, 0.0]\ndirection = [0.0, -1.0, 0.0]\n"
        for i in range(count)
    ]
    content = head + ("".join(leds) or "leds = []\n")
    assert f"has {count} LED(s)" in refusal(tmp_path / "a.toml", content, load_probe).what


def test_a_probe_whose_leds_can_be_confused(tmp_path: Path) -> None:
    error = refusal(tmp_path / "a.toml", RECTANGLE, load_probe)
    assert error.code == "probe.ambiguous"
    assert "would put the tip" in error.what


def test_orientation_rules_make_the_rectangle_usable(tmp_path: Path) -> None:
    rules = """
orientation_rules = [
  {probe_axis = [0.0, 0.0, 1.0], world_direction = [0.0, 0.0, 1.0]},
  {probe_axis = [0.0, -1.0, 0.0], world_direction = [0.0, -1.0, 0.0]},
]
"""
    (tmp_path / "a.toml").write_text(RECTANGLE + rules)
    assert len(load_probe(tmp_path / "a.toml").rules) == 2


def test_a_write_leaves_the_old_file_or_the_new_one(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    write_atomic(path, b"old")
    write_atomic(path, b"new")
    assert path.read_bytes() == b"new"
    with pytest.raises(FileNotFoundError):
        write_atomic(tmp_path / "nowhere" / "a.toml", b"x")
    (tmp_path / "folder").mkdir()
    with pytest.raises(IsADirectoryError):
        write_atomic(tmp_path / "folder", b"x")
    assert sorted(item.name for item in tmp_path.iterdir()) == ["a.toml", "folder"]


class Sample(Document, frozen=True, kw_only=True):
    count: int


def test_any_document_may_be_defined(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_text('schema = "ocmm.sample/3"\nunit = "mm"\ncount = 5\n')
    assert load_document(str(path), Sample, "ocmm.sample/3").count == 5
    assert refusal(
        path, 'schema = "ocmm.sample/3"\nunit = "mm"\ncount = 5.5\n',
        lambda p: load_document(p, Sample, "ocmm.sample/3"),
    ).code == "document.field"  # fmt: skip


@pytest.fixture
def closed_folder() -> Iterator[Path]:
    """Return a folder with a folder that this process cannot read."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        for path in (folder / "a" / "one.x", folder / "shut" / "two.x", folder / "Z.X"):
            path.parent.mkdir(exist_ok=True)
            path.touch()
        (folder / "shut").chmod(0)
        is_root = os.geteuid() == 0
        try:
            if is_root:
                os.seteuid(65534)
            yield folder
        finally:
            if is_root:
                os.seteuid(0)
            (folder / "shut").chmod(0o755)


def test_folders_that_cannot_be_read_are_errors_and_not_empty(closed_folder: Path) -> None:
    found, left_out = find_files(closed_folder, ".x")
    assert [path.name for path in found] == ["Z.X", "one.x"]
    assert [one.what for one in left_out] == [
        f"{closed_folder / 'shut'}: this folder cannot be read (Permission denied)."
    ]
    with pytest.raises(InputError, match="cannot be read"):
        files_of_folder(closed_folder / "shut", ".x")
    assert files_of_folder(closed_folder / "none", ".x") == []
    assert find_files(closed_folder / "none") == ([], [])

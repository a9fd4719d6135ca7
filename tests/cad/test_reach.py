"""Reach of a probe and sight of cameras: boxes of triangles, places and attitudes; no library."""

from __future__ import annotations

from types import FunctionType, ModuleType
from typing import Any

import msgspec
import numpy as np
import pytest

from ocmm_cad.reach import Obstacle, Reach, Setting, SurfaceTargets, make_obstacle
from ocmm_cad.reach import _tree_kernel as kernel
from ocmm_cad.step import setting_of, up_of, usual_request
from ocmm_core.calibration.probe_design import load_design, shipped_design
from ocmm_core.camera import load_rig, on_sensor, project
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, unit
from ocmm_core.part_model import Placement
from ocmm_core.tracking import load_probe

BODY = load_probe(resource("probes", "standard.toml"))
RIG = load_rig(resource("rigs", "recommended.toml"))
DESIGN = load_design(shipped_design(BODY) or "", BODY)
SETTING = Setting(BODY, DESIGN, RIG)
NO_AXES = np.empty((0, 3))
UP, DOWN, LEFT, RIGHT, FRONT, BACK = (
    np.array(row, dtype=np.float64)
    for row in ((0, 0, 1), (0, 0, -1), (-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0))
)


def boxes(*corners: tuple[tuple[float, ...], tuple[float, ...]]) -> Obstacle:
    """Return boxes, each with six faces in a row: left, right, front, back, bottom, top."""
    triangles, faces = [], []
    for number, (low, high) in enumerate(corners):
        c = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1])
                      for z in (low[2], high[2])])  # fmt: skip
        quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
        for side, (a, b, d, e) in enumerate(quads):
            triangles += [c[[a, b, d]], c[[a, d, e]]]
            faces += [6 * number + side] * 2
    return make_obstacle(np.array(triangles), np.array(faces), 6 * len(corners), 0.02)


BLOCK = boxes(((0, 0, 0), (100, 60, 20)))


@pytest.mark.parametrize(
    ("point", "normal", "own"),
    [
        ((50, 30, 20), UP, 5), ((0, 30, 10), LEFT, 0), ((100, 30, 10), RIGHT, 1),
        ((50, 0, 10), FRONT, 2), ((50, 60, 10), BACK, 3),
    ],
)  # fmt: skip
def test_a_block_is_reached_from_above_and_from_its_sides(
    point: tuple[float, ...], normal: Float, own: int
) -> None:
    found = Reach(BLOCK, 3.0, SETTING, NO_AXES).evaluate(
        np.array([point], float), normal[None], [own]
    )
    assert found.stage.tolist() == [0]
    assert found.leds[0] >= 4
    assert found.ways_mm[0] == 8.0
    handle = found.turns_part_from_probe[0] @ DESIGN.axis_probe
    assert handle @ normal > 0.0
    assert handle[2] > 0.5


def test_what_faces_down_is_left_out_with_the_face_that_the_stylus_meets() -> None:
    reach = Reach(BLOCK, 3.0, SETTING, NO_AXES)
    found = reach.evaluate(np.array([[50.0, 30.0, 0.0]]), DOWN[None], [4])
    assert found.stage[0] != 0
    assert np.isnan(found.turns_part_from_probe).all()
    assert reach.why_not(found) == "the stylus would touch face 5"
    # Turned over it can be touched.
    turned = Setting(BODY, DESIGN, RIG, Placement(up=(0.0, 0.0, -1.0)))
    assert Reach(BLOCK, 3.0, turned, NO_AXES).evaluate(
        np.array([[50.0, 30.0, 0.0]]), DOWN[None], [4]
    ).stage.tolist() == [0]  # fmt: skip


@pytest.mark.parametrize(("width", "stage"), [(5.9, 1), (6.1, 1), (6.6, 0)])
def test_a_slit_narrower_than_the_ball_has_no_target(width: float, stage: int) -> None:
    # Two walls side by side; the ball touches the right side of the first near its top.
    walls = boxes(((0, 0, 0), (50, 60, 20)), ((50 + width, 0, 0), (100, 60, 20)))
    reach = Reach(walls, 3.0, None, NO_AXES)
    found = reach.evaluate(np.array([[50.0, 30.0, 18.0]]), RIGHT[None], [1])
    assert found.stage.tolist() == [stage]
    if stage:
        assert reach.why_not(found) == "the ball would touch face 7"


def test_a_roof_over_a_target_is_met_by_the_body_of_the_probe() -> None:
    # 60 mm above: the stylus of 40 mm fits below it, the panel does not; wide to all sides.
    roof = boxes(((0, 0, 0), (100, 60, 20)), ((-600, -600, 80), (600, 600, 90)))
    reach = Reach(roof, 3.0, Setting(BODY, DESIGN), NO_AXES)
    found = reach.evaluate(np.array([[50.0, 30.0, 20.0]]), UP[None], [5])
    assert found.stage[0] != 0
    assert "would touch face" in reach.why_not(found)
    # Without a probe only the ball is checked, and it has room.
    assert Reach(roof, 3.0, None, NO_AXES).evaluate(
        np.array([[50.0, 30.0, 20.0]]), UP[None], [5]
    ).stage.tolist() == [0]  # fmt: skip


def test_a_wall_towards_the_cameras_hides_the_leds() -> None:
    wall = boxes(((0, 0, 0), (100, 60, 20)), ((-900, -300, -400), (900, -290, 900)))
    pose = Placement(offset_world=(0.0, 0.0, 0.0))
    blind = Setting(BODY, DESIGN, RIG, pose)
    reach = Reach(wall, 3.0, blind, NO_AXES)
    point = np.array([[50.0, 30.0, 20.0]])
    moved = blind.pose(wall.middle).apply(point)
    if np.any(moved < RIG.volume_world[0]) or np.any(moved > RIG.volume_world[1]):
        shift = RIG.volume_world.mean(axis=0) - moved[0]
        blind = Setting(BODY, DESIGN, RIG, Placement(offset_world=tuple(shift.tolist())))
        reach = Reach(wall, 3.0, blind, NO_AXES)
    found = reach.evaluate(point, UP[None], [5])
    assert found.stage[0] != 0
    assert "LEDs of the probe there, 4 are needed" in reach.why_not(found)
    without = Reach(wall, 3.0, Setting(BODY, DESIGN), NO_AXES)
    assert without.evaluate(point, UP[None], [5]).stage.tolist() == [0]


def test_outside_the_volume_of_the_rig_nothing_is_measured() -> None:
    away = Setting(BODY, DESIGN, RIG, Placement(offset_world=(1000.0, 0.0, 0.0)))
    reach = Reach(BLOCK, 3.0, away, NO_AXES)
    found = reach.evaluate(np.array([[50.0, 30.0, 20.0]]), UP[None], [5])
    assert reach.why_not(found) == "it is outside the measuring volume where the part stands"


def test_a_bore_is_entered_along_its_axis() -> None:
    # A square shaft of 30 mm through a high block, as four blocks: at 40 mm no probe leans.
    high = 90.0
    shaft = boxes(
        ((0, 0, 0), (40, 100, high)), ((70, 0, 0), (110, 100, high)),
        ((40, 0, 0), (70, 35, high)), ((40, 65, 0), (70, 100, high)),
    )  # fmt: skip
    reach = Reach(shaft, 3.0, Setting(BODY, DESIGN), UP[None])
    points = np.array([[40.0, 50.0, high - 8.0], [40.0, 50.0, high - 60.0]])
    found = reach.evaluate(points, np.tile(RIGHT, (2, 1)), [1], UP)
    assert found.stage[0] == 0
    # The panel of 40 mm and more does not fit into the shaft.
    assert found.stage[1] in (2, 3)


def test_leds_counted_are_those_that_both_cameras_show() -> None:
    reach = Reach(BLOCK, 3.0, SETTING, NO_AXES)
    points = np.column_stack([np.linspace(5, 95, 30), np.full(30, 30.0), np.full(30, 20.0)])
    found = reach.evaluate(points, np.tile(UP, (30, 1)), [5])
    pose = SETTING.pose(BLOCK.middle)
    for point, turn, count in zip(points, found.turns_part_from_probe, found.leds, strict=True):
        leds = pose.apply(BODY.leds_probe @ turn.T + point + 3.0 * UP)
        looks = BODY.led_directions_probe @ turn.T @ pose.rotation.T
        both = np.ones(len(leds), dtype=np.bool_)
        for camera in RIG.cameras:
            ray = unit(camera.centre_world - leds)
            both &= (looks * ray).sum(axis=1) >= np.cos(BODY.emission_half_angle)
            both &= on_sensor(camera, project(camera, leds))
        assert both.sum() >= count >= 4


def brute(point: Float, triangle: Float, steps: int = 160) -> float:
    """Return the distance of a point from a triangle by trying many points of it."""
    share = np.linspace(0.0, 1.0, steps)
    u, v = (grid.ravel() for grid in np.meshgrid(share, share))
    on_it = (
        triangle[0]
        + (u * (1 - v))[:, None] * (triangle[1] - triangle[0])
        + ((u * v)[:, None] * (triangle[2] - triangle[0]))
    )
    return float(np.linalg.norm(on_it - point, axis=1).min())


def test_the_distance_from_a_triangle_is_that_of_its_nearest_point() -> None:
    rng = np.random.default_rng(5)
    for _ in range(100):
        triangle, point = rng.uniform(-1, 1, (3, 3)), rng.uniform(-2, 2, 3)
        exact = kernel.point_triangle.py_func(*point, triangle)  # type: ignore[attr-defined]
        # Points of the grid are up to 0.02 apart, so none is nearer and one is about as near.
        assert exact - 1e-12 <= brute(point, triangle) <= exact + 0.02


def bar(start: Float, end: Float, at_start: float, at_end: float) -> Float:
    """Return the hull of two balls as a row of numbers."""
    row = np.zeros(kernel.N_COLUMNS)
    row[kernel.START : kernel.START + 3], row[kernel.END : kernel.END + 3] = start, end
    row[kernel.AT_START], row[kernel.AT_END] = at_start, at_end
    return row


def _plain(module: ModuleType) -> dict[str, Any]:
    """Return the functions of a module of compiled loops in plain Python, callees included."""
    found = dict(vars(module))
    for name, one in vars(module).items():
        if hasattr(one, "py_func"):
            found[name] = FunctionType(one.py_func.__code__, found, name)
    return found


PLAIN = _plain(kernel)


def met(body: Float, part: Obstacle, gap: float, own: int = -1, own_gap: float = 0.0) -> int:
    """Return the face that a body comes nearer to than a gap; `own_gap` holds for one of them."""
    surfaces = np.arange(part.n_faces)
    mesh = kernel.PartMesh(part.triangles, part.faces, surfaces, part.boxes, part.links, part.order)
    return int(PLAIN["first_near"](body, gap, own_gap, mesh, own))


def test_a_bar_comes_as_near_to_a_triangle_as_the_nearest_of_many_balls_along_it() -> None:
    """Ways that rise at their start among them, as of a ball that leaves its surface."""
    rng = np.random.default_rng(107)
    exact = PLAIN["point_triangle"]
    rising = near = 0
    for number in range(200):
        triangle, start = rng.uniform(-1, 1, (3, 3)), rng.uniform(-1.5, 1.5, 3)
        way = rng.uniform(-3, 3, 3)
        if number % 2:
            # Away from the triangle, or nearly along it: the least is at the start or close to it.
            way = 2.0 * unit(start - triangle.mean(axis=0)) + 0.3 * way
        ends = rng.uniform(0.0, 0.4, 2)
        body = bar(start, start + way, *ends)
        shares = np.linspace(0.0, 1.0, 1001)
        truth = np.array([
            exact(*(start + share * way), triangle)
            - (ends[0] + share * (ends[1] - ends[0]))
            for share in shares
        ])  # fmt: skip
        rising += bool(truth[4] >= truth[0])
        least = truth.min()
        # Between two of them it falls by half a step at most.
        one = make_obstacle(triangle[None], np.zeros(1, dtype=np.int64), 1, 0.0)
        step = 0.5 * (np.linalg.norm(way) + abs(ends[1] - ends[0])) / 1000.0
        for gap in (least + 1e-9, least - step - 1e-9, least + 0.3, least - 0.3):
            found = met(body, one, gap) == 0
            assert found == (least < gap)
            near += found
    assert rising > 60
    assert near == 400


def test_a_ball_that_leaves_one_side_of_a_groove_meets_the_other() -> None:
    """A path that rises from its own triangle falls towards another: each triangle is checked."""
    groove = boxes(((-1, -50, 0), (0, 50, 40)), ((9, -50, 0), (10, 50, 40)))
    for reach, meets in ((2.9, False), (3.1, True)):
        # A ball of 3 that touches the wall at x = 0, and goes along its normal.
        start = np.array([3.0, 0.0, 20.0])
        row = bar(start, start + np.array([reach, 0.0, 0.0]), 3.0, 3.0)
        found = met(row, groove, 0.0, own=1, own_gap=-0.1)
        assert (found == 6) == meets
        assert meets or found == kernel.FREE


@pytest.mark.parametrize(
    "kind", ["random", "equal", "sorted", "falling", "two values", "not a number"]
)
@pytest.mark.parametrize("count", [1, 4, 5, 6, 37, 500])
def test_every_triangle_is_in_one_leaf_and_inside_its_boxes(kind: str, count: int) -> None:
    rng = np.random.default_rng(5)
    at = {
        "random": rng.uniform(-9, 9, count),
        "equal": np.zeros(count),
        "sorted": np.arange(count, dtype=np.float64),
        "falling": np.arange(count, dtype=np.float64)[::-1],
        "two values": rng.integers(0, 2, count).astype(np.float64),
        "not a number": np.where(rng.uniform(size=count) < 0.3, np.nan, rng.uniform(size=count)),
    }[kind]
    triangles = np.zeros((count, 3, 3))
    triangles[:, :, 0] = at[:, None] + [0.0, 0.1, 0.2]
    made = make_obstacle(triangles, np.zeros(count, dtype=np.int64), 1, 0.02)
    assert sorted(made.order.tolist()) == list(range(count))
    left, seen, deepest = [(0, 0)], [], 0
    while left:
        box, depth = left.pop()
        deepest = max(deepest, depth)
        first, number = made.links[box].tolist()
        if number < 0:
            left += [(first, depth + 1), (first + 1, depth + 1)]
            below = made.boxes[[first, first + 1]]
            if kind != "not a number":
                assert (made.boxes[box, :3] <= below[:, :3]).all()
                assert (made.boxes[box, 3:] >= below[:, 3:]).all()
            continue
        seen += made.order[first : first + number].tolist()
    assert sorted(seen) == list(range(count))
    # By the median: as deep as log2 of their number, however they lie.
    assert deepest <= int(np.ceil(np.log2(max(count / 2, 1))))


def test_orientation_rules_of_the_probe_are_kept() -> None:
    thesis = load_probe(resource("probes", "thesis.toml"))
    path = shipped_design(thesis)
    setting = Setting(thesis, load_design(path, thesis) if path else None, RIG)
    reach = Reach(BLOCK, 3.0, setting, NO_AXES)
    found = reach.evaluate(np.array([[0.0, 30.0, 10.0]]), LEFT[None], [0])
    (turn,) = found.turns_part_from_probe
    assert found.stage.tolist() == [0]
    for axis, world in thesis.rules:
        assert (turn @ axis) @ world > 0.2


def test_where_rules_leave_no_attitude_that_is_said() -> None:
    thesis = load_probe(resource("probes", "thesis.toml"))
    for rig in (RIG, None):
        reach = Reach(BLOCK, 3.0, Setting(thesis, None, rig), NO_AXES)
        found = reach.evaluate(np.array([[50.0, 30.0, 0.0]]), DOWN[None], [4])
        assert "held from below" in reach.why_not(found)


@pytest.mark.parametrize("word", ["+z", "-Z", "x", "+y"])
def test_an_axis_is_named_by_its_letter(word: str) -> None:
    up = up_of(word)
    assert np.linalg.norm(up) == 1.0
    assert up["xyz".index(word[-1].lower())] == (-1.0 if word[0] == "-" else 1.0)


@pytest.mark.parametrize("word", ["", "up", "+w", "--z", "zz"])
def test_other_words_are_no_axis(word: str) -> None:
    with pytest.raises(InputError, match="axis"):
        up_of(word)


def test_a_placement_without_a_direction_is_refused() -> None:
    with pytest.raises(InputError, match="cannot stand"):
        setting_of(msgspec.structs.replace(usual_request(), up=(0.0, 0.0, 0.0)))


def test_surfaces_that_are_asked_at_once_are_answered_as_one_by_one() -> None:
    """Also if one surface has no suitable handle, and if a surface's own faces count."""
    reach = Reach(BLOCK, 3.0, SETTING, UP[None])
    asked = [
        SurfaceTargets(
            np.array([[50.0, 30.0, 20.0], [20.0, 30.0, 20.0]]), np.tile(UP, (2, 1)), [5]
        ),
        SurfaceTargets(np.array([[50.0, 30.0, 0.0]]), DOWN[None], [4]),
        SurfaceTargets(np.array([[0.0, 30.0, 10.0], [0.0, 20.0, 4.0]]), np.tile(LEFT, (2, 1)), [0]),
        SurfaceTargets(np.array([[100.0, 30.0, 10.0]]), RIGHT[None], [1], RIGHT),
    ]
    at_once = reach.of_each(asked)
    assert at_once[0].stage.tolist() == [0, 0]
    for places, found in zip(asked, at_once, strict=True):
        alone = reach.evaluate(places.points, places.normals, places.own, places.axis_part)
        for name in ("stage", "face", "turns_part_from_probe", "ways_mm", "leds"):
            assert np.array_equal(getattr(found, name), getattr(alone, name), equal_nan=True)
    assert reach.of_each([]) == []


def test_a_mesh_that_came_through_a_pipe_is_of_the_type_that_is_compiled() -> None:
    triangles = np.frombuffer(np.array(BLOCK.triangles).tobytes()).reshape(-1, 3, 3)
    faces = np.frombuffer(np.array(BLOCK.faces).tobytes(), dtype=np.int64)
    assert not triangles.flags.writeable
    made = make_obstacle(triangles, faces, BLOCK.n_faces, 0.02)
    assert made.triangles.flags.writeable
    assert made.faces.flags.writeable


def test_long_triangles_lie_in_the_tree_in_pieces() -> None:
    """A face with thousands of holes has some as long as the part, all over the boxes of others."""
    at = np.arange(400.0)
    small = np.zeros((400, 3, 3))
    small[:, :, 0] = at[:, None] + [0.0, 1.0, 0.0]
    small[:, 2, 1] = 1.0
    # Across all of them, and 0.2 wide.
    long = np.array([[[0.0, -3.0, 0.0], [400.0, -3.0, 0.0], [400.0, -3.2, 0.0]]])
    both = np.concatenate([long, small])
    made = make_obstacle(both, np.array([0, *[1] * 400]), 2, 0.0)
    pieces = made.triangles[made.faces == 0]
    # A quarter more of all triangles are allowed.
    assert 32 <= len(pieces) <= 1 + 0.25 * len(both)
    assert np.ptp(pieces[:, :, 0], axis=1).max() <= 400.0 / 8
    area = 0.5 * np.linalg.norm(
        np.cross(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0]), axis=1
    )
    # 400 by 0.2 by half, to the rounding of some hundred cuts.
    assert area.sum() == pytest.approx(40.0, abs=1e-9)
    assert (made.faces == 1).sum() == 400
    for x in (0.5, 200.3, 399.0):
        up = np.array([x, -3.0, 5.0])
        assert met(bar(up, up - [0.0, 0.0, 4.5], 0.4, 0.4), made, 0.2) == 0
        assert met(bar(up, up - [0.0, 0.0, 4.2], 0.4, 0.4), made, 0.2) == kernel.FREE

"""Parts painted by the processor: pixels, edges and layers are what rays would meet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ocmm_core.geometry import Float
from ocmm_core.part_model import PartModel, model_from_bytes, model_to_bytes
from ocmm_gui.rendering import (
    NO_FACE,
    Canvas,
    Rendering,
    RenderMesh,
    RenderMode,
    RenderStyle,
    Wires,
    blend_flat,
    coarser,
    face_colours,
    is_hidden,
    mesh_of,
    with_closed,
)
from tests.made_parts import PartMaker
from tests.part_models import block_part

WIDTH, HEIGHT = 320, 200
EDGE, FILL, BASE = "#ff0000", "#ffffff", "#8090a0"
STYLES = {mode: RenderStyle(mode, EDGE, FILL) for mode in RenderMode}


def block_with_a_post() -> PartModel:
    maker = PartMaker().box((-60.0, -40.0, 0.0), (60.0, 40.0, 20.0), steps=3)
    maker.tube((20.0, 0.0, 20.0), 30.0, 15.0).disc((20.0, 0.0, 50.0), 15.0)
    return maker.ball((-30.0, 0.0, 35.0), 20.0).part()


def view_of(
    azimuth: float, elevation: float, radius: float = 75.0, middle: Float | None = None
) -> tuple[Float, Float]:
    """Return matrix and offset of a view that has ``middle`` in the middle of the picture."""
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    outward = np.array([ce * ca, ce * sa, se])
    right = np.array([-sa, ca, 0.0])
    up = np.cross(outward, right)
    scale = 0.5 * HEIGHT / radius
    matrix = np.stack([scale * right, -scale * up, outward], axis=1)
    centre = np.array([0.0, 0.0, 25.0]) if middle is None else middle
    return matrix, np.array([0.5 * WIDTH, 0.5 * HEIGHT, 0.0]) - centre @ matrix


def painted(
    model: PartModel,
    view: tuple[Float, Float],
    mode: RenderMode = RenderMode.SHADED,
    mesh: RenderMesh | None = None,
) -> Canvas:
    canvas = Canvas(WIDTH, HEIGHT)
    shown = mesh_of(model) if mesh is None else mesh
    colours = shown.vertex_colours(face_colours(model, BASE))
    assert Rendering(shown, *view, canvas, STYLES[mode], colours).go_on()
    return canvas


def met_by_ray(
    mesh: RenderMesh, view: tuple[Float, Float], x: float, y: float
) -> tuple[float, int]:
    """Return depth and face nearest to the eye, by barycentric coordinates."""
    places = (mesh.vertices @ view[0] + view[1])[mesh.triangles]
    a, u, v = places[:, 0], places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]
    with np.errstate(all="ignore"):
        area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        dx, dy = x - a[:, 0], y - a[:, 1]
        s = (dx * v[:, 1] - dy * v[:, 0]) / area
        t = (u[:, 0] * dy - u[:, 1] * dx) / area
        z = a[:, 2] + s * u[:, 2] + t * v[:, 2]
        inside = (np.abs(area) > 1e-9) & (s >= 0) & (t >= 0) & (s + t <= 1)
    if not inside.any():
        return -np.inf, NO_FACE
    best = int(np.argmax(np.where(inside, z, -np.inf)))
    return float(z[best]), int(mesh.triangle_faces[best])


@pytest.mark.parametrize("azimuth", [0.3, 2.0, 4.4])
@pytest.mark.parametrize("elevation", [-0.7, 0.0, 0.5, 1.5])
def test_pixels_show_what_rays_meet(azimuth: float, elevation: float) -> None:
    model, view = block_with_a_post(), view_of(azimuth, elevation)
    canvas, mesh = painted(model, view), mesh_of(model)
    rng = np.random.default_rng(4)
    wrong = 0
    for _ in range(400):
        column, row = int(rng.integers(WIDTH)), int(rng.integers(HEIGHT))
        z, face = met_by_ray(mesh, view, column + 0.5, row + 0.5)
        if canvas.face_at(column + 0.2, row + 0.8) != face:
            wrong += 1
        elif face != NO_FACE:
            # Single precision in the buffer; between faces that touch either may win.
            assert canvas.depth[row, column] == pytest.approx(z, abs=1e-3)
    assert wrong <= 2, "only a centre that lies on a border to rounding may go to the other side"


def test_a_closed_surface_has_no_holes_and_the_depth_of_a_ball() -> None:
    model = PartMaker().ball((0.0, 0.0, 25.0), 50.0, steps=96).part()
    canvas = painted(model, view_of(0.7, 0.4))
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    scale = 0.5 * HEIGHT / 75.0
    square = ((x - 0.5 * WIDTH) ** 2 + (y - 0.5 * HEIGHT) ** 2) / scale**2
    inside = square < 49.5**2
    assert (canvas.faces[inside] == 0).all()
    assert (canvas.faces[square > 50.0**2] == NO_FACE).all()
    # A chord of 1/96 of half a turn lies r (1 - cos) = 0.007 mm deep; at the rim it is more.
    flat = square < 30.0**2
    np.testing.assert_allclose(
        canvas.depth[flat], np.sqrt(50.0**2 - square[flat]), atol=0.03
    )  # fmt: skip


def test_an_edge_behind_the_part_is_seen_in_the_transparent_part_alone() -> None:
    model = PartMaker().box((-30.0, -30.0, 0.0), (30.0, 30.0, 50.0)).part()
    view = view_of(0.6, 0.5)
    # On the edge that is farthest away, seen through the top.
    column, row, _ = (int(value) for value in np.array([-30.0, -30.0, 25.0]) @ view[0] + view[1])
    window = np.s_[row - 3 : row + 4, column - 4 : column + 5]
    seen = {mode: _spread(painted(model, view, mode).image[window]) for mode in RenderMode}
    assert seen[RenderMode.SHADED] == seen[RenderMode.HIDDEN_LINES] == 0
    assert seen[RenderMode.TRANSPARENT] > 20


def test_edges_in_front_are_drawn_along_their_whole_length() -> None:
    model = PartMaker().box((-30.0, -30.0, 0.0), (30.0, 30.0, 50.0)).part()
    view = view_of(0.6, 0.5)
    canvas = painted(model, view, RenderMode.HIDDEN_LINES)
    for start, end in (((30, 30, 0), (30, 30, 50)), ((30, -30, 50), (30, 30, 50))):
        for share in np.linspace(0.02, 0.98, 60):
            place = np.array(start) + share * (np.array(end) - np.array(start))
            x, y, _ = place @ view[0] + view[1]
            near = canvas.image[int(y) - 1 : int(y) + 2, int(x) - 1 : int(x) + 2]
            # The background is white: green is low at an edge.
            assert ((near >> 8) & 255).min() < 150


def test_a_transparent_part_has_the_layer_behind() -> None:
    model = PartMaker().box((-30.0, -30.0, 0.0), (30.0, 30.0, 50.0)).part()
    view = view_of(0.6, 0.5)
    shaded = painted(model, view, RenderMode.SHADED)
    clear = painted(model, view, RenderMode.TRANSPARENT)
    np.testing.assert_array_equal(shaded.faces, clear.faces)
    alpha = clear.image[shaded.faces >= 0] >> 24
    # 1 - (1 - 0.42)(1 - 0.5) of 255 is 181.
    assert np.median(alpha) == 181
    assert ((shaded.image[shaded.faces >= 0] >> 24) == 255).all()


@pytest.mark.parametrize("mode", list(RenderMode))
def test_slices_paint_what_is_painted_at_once(mode: RenderMode) -> None:
    model, view = PartMaker().ball((0.0, 0.0, 25.0), 40.0, steps=64).part(), view_of(0.3, 0.3)
    canvas = Canvas(WIDTH, HEIGHT)
    canvas.image.fill(7)
    rendering = Rendering(
        mesh_of(model), *view, canvas, STYLES[mode], face_colours(model, BASE)
    )  # fmt: skip
    slices = 1
    while not rendering.go_on(until_s=0.0):
        slices += 1
    assert slices > 4
    at_once = painted(model, view, mode)
    np.testing.assert_array_equal(canvas.image, at_once.image)
    np.testing.assert_array_equal(canvas.depth, at_once.depth)


def test_a_closed_surface_is_known_and_painted_the_same_without_its_backs() -> None:
    model = block_with_a_post()
    whole = mesh_of(model)
    closed = with_closed(whole)
    assert not whole.closed.any()
    # Block and ball are closed, the post has no foot.
    is_post = (whole.vertices[whole.triangles][:, :, 2] > 19.9).all(axis=1)
    is_post &= np.hypot(*(whole.vertices[whole.triangles].mean(axis=1)[:, :2] - [20.0, 0.0]).T) < 16
    np.testing.assert_array_equal(closed.closed == 0, is_post & (closed.closed == 0))
    assert closed.closed.mean() > 0.5
    assert not closed.closed[is_post & (whole.vertices[whole.triangles][:, 0, 2] > 20.1)].any()
    for azimuth in (0.3, 2.0, 4.4):
        view = view_of(azimuth, 0.5)
        both, front = painted(model, view), painted(model, view, mesh=closed)
        # A pixel whose middle lies on the outline may go to the back of it.
        assert np.mean(both.faces != front.faces) < 1e-4
        assert np.mean(both.image != front.image) < 1e-4


def test_an_open_surface_and_one_inside_out_keep_their_backs() -> None:
    model = PartMaker().box((-60.0, -40.0, 0.0), (60.0, 40.0, 20.0), steps=3).part()
    whole = mesh_of(model)
    assert with_closed(whole).closed.all()
    opened = replace(
        whole, triangles=whole.triangles[1:].copy(), triangle_faces=whole.triangle_faces[1:].copy(),
        closed=whole.closed[1:].copy(),
    )  # fmt: skip
    assert not with_closed(opened).closed.any()
    inside_out = replace(whole, triangles=np.ascontiguousarray(whole.triangles[:, ::-1]))
    assert not with_closed(inside_out).closed.any()
    lost = replace(whole, vertices=np.where(whole.vertices > 5.0, np.nan, whole.vertices))
    assert not with_closed(lost).closed.any()


def test_a_picture_at_once_is_the_one_in_slices_on_a_ground_too() -> None:
    model = block_with_a_post()
    mesh = with_closed(mesh_of(model))
    colours = face_colours(model, BASE)
    for mode in RenderMode:
        style = replace(STYLES[mode], ground="#336699")
        canvases = []
        for until in (np.inf, 0.0):
            canvas = Canvas(WIDTH, HEIGHT)
            rendering = Rendering(mesh, *view_of(0.6, 0.5), canvas, style, colours)
            while not rendering.go_on(until):
                pass
            canvases.append(canvas)
        np.testing.assert_array_equal(canvases[0].image, canvases[1].image)
        np.testing.assert_array_equal(canvases[0].depth, canvases[1].depth)
        # Opaque everywhere: who shows it need not blend it.
        assert (canvases[0].image >> 24 == 255).all()
        assert canvases[0].image[0, 0] == 0xFF336699


def test_lines_of_a_bundle_are_hidden_by_the_part_and_seen_beside_it() -> None:
    canvas = painted(block_with_a_post(), view_of(0.6, 0.5))
    before = canvas.image.copy()
    rows, columns = np.nonzero(canvas.faces >= 0)
    y, x = float(np.median(rows)) + 0.5, float(np.median(columns))
    far, near = -1e4, 1e4
    line = np.array([[[x - 8.0, y, far], [x + 8.0, y, far]]])
    wires = Wires([(line, 2.0, "#ff0000")], [])
    wires.draw_lines(canvas, lambda places: places, 1.0, 0.1, 0.0)
    np.testing.assert_array_equal(canvas.image, before)
    wires = Wires([(line * [1, 1, 0] + [0, 0, near], 2.0, "#ff0000")], [])
    wires.draw_lines(canvas, lambda places: places, 1.0, 0.1, 0.0)
    assert canvas.image[int(y), int(x)] == 0xFFFF0000


def test_a_coarser_mesh_keeps_faces_and_extent_and_has_no_gaps() -> None:
    model = PartMaker().ball((0.0, 0.0, 25.0), 50.0, steps=200).part()
    whole = mesh_of(model)
    assert len(whole.triangles) == 160000
    few = coarser(whole, 20000)
    assert 1000 < len(few.triangles) <= 20000
    assert coarser(few, 20000) is few
    off = np.abs(np.linalg.norm(few.vertices - [0.0, 0.0, 25.0], axis=1) - 50.0)
    assert off.max() < few.cell_mm
    np.testing.assert_allclose(np.linalg.norm(few.normals, axis=1), 1.0, atol=1e-9)
    canvas = painted(model, view_of(0.7, 0.4), mesh=few)
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    inside = np.hypot(x - 0.5 * WIDTH, y - 0.5 * HEIGHT) < 45.0 * 0.5 * HEIGHT / 75.0
    assert (canvas.faces[inside] == 0).all()
    both = mesh_of(block_with_a_post())
    assert set(coarser(both, 60).triangle_faces) <= set(both.triangle_faces)


def test_faces_have_their_colours_and_marked_ones_another() -> None:
    maker = PartMaker().box((-30.0, -30.0, 0.0), (30.0, 30.0, 50.0))
    model = maker.part()
    top = 5
    colours = face_colours(model, "#101010", {top: "#00ff00"})
    canvas = Canvas(WIDTH, HEIGHT)
    Rendering(
        mesh_of(model), *view_of(0.6, 0.5), canvas, STYLES[RenderMode.SHADED], colours
    ).go_on()
    inner = canvas.image[_eroded(canvas.faces == top)]
    assert len(inner) > 500
    assert ((inner >> 8) & 255 > 100).all()
    assert ((inner & 0xFF00FF) == 0).all()


def test_what_a_ray_says_is_what_the_picture_says() -> None:
    model, view = block_with_a_post(), view_of(0.5, 0.6)
    mesh, canvas = mesh_of(model), painted(model, view)
    rng = np.random.default_rng(9)
    rows = rng.choice(len(mesh.vertices), 300, replace=False)
    points = mesh.vertices[rows]
    hidden = np.array([is_hidden(mesh, point, view[0][:, 2], 3.0) for point in points])
    in_sight = canvas.in_sight(points @ view[0] + view[1], 3.0)
    # At the rim of what hides a point the pixel and the ray may differ.
    assert np.mean(hidden == ~in_sight) > 0.95
    assert 60 < hidden.sum() < 280


def test_a_flat_polygon_is_seen_before_the_part_and_not_behind_it() -> None:
    model, view = PartMaker().box((-30.0, -30.0, 0.0), (30.0, 30.0, 50.0)).part(), view_of(0.0, 0.0)
    canvas = painted(model, view)
    before = canvas.image.copy()
    square = np.array([[0.0, -20, 10], [0, 20, 10], [0, 20, 40], [0, -20, 40]])
    blend_flat(canvas, (square - np.array([40.0, 0, 0])) @ view[0] + view[1], "#ff00ff", 0.5, 1.0)
    np.testing.assert_array_equal(canvas.image, before)
    blend_flat(canvas, (square + np.array([30.0, 0, 0])) @ view[0] + view[1], "#ff00ff", 0.5, 1.0)
    scale = 0.5 * HEIGHT / 75.0
    assert (canvas.image != before).sum() == pytest.approx(40 * 30 * scale**2, rel=0.05)


@pytest.mark.parametrize("radius", [1e-3, 1e7])
def test_a_view_from_very_near_or_very_far_paints_within_its_bounds(radius: float) -> None:
    canvas = painted(block_with_a_post(), view_of(0.5, 0.6, radius))
    assert (canvas.faces >= NO_FACE).all()


def test_arrays_of_a_file_are_painted_by_what_the_set_up_compiled() -> None:
    # The fixture of all tests finds functions compiled for read-only arrays.
    read = model_from_bytes(model_to_bytes(block_part()), "block")
    canvas = painted(read, view_of(0.5, 0.6))
    assert (canvas.faces >= 0).any()
    assert not is_hidden(mesh_of(read), np.array([0.0, 0.0, 500.0]), np.array([0.0, 0, 1]), 0.0)


def test_vertices_that_are_no_numbers_paint_nothing() -> None:
    model = block_with_a_post()
    model.vertices[:] = np.nan
    canvas = painted(model, view_of(0.5, 0.6))
    assert (canvas.faces == NO_FACE).all()


def _spread(image: NDArray[np.uint32]) -> int:
    """Return how different the greens are: of faces they are alike, the edges have none."""
    green = ((image >> 8) & 255).astype(int)
    return int(green.max() - green.min())


def _eroded(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the mask without pixels less than three from its border."""
    inner = mask.copy()
    for axis in (0, 1):
        for step in (-3, -2, -1, 1, 2, 3):
            inner &= np.roll(mask, step, axis)
    return inner

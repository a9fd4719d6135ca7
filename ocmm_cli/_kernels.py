"""All compiled functions that Python calls, with their argument types; compiled in advance.

Set-up compiles these. numba caches one result per combination of types: a call with other types
would compile at run time and delay measuring. Callees of compiled functions are inlined and not
listed. A test checks every call in all other tests against this list.
"""

from __future__ import annotations

import gc
import multiprocessing
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numba
from numba.core import event

from ocmm_core.host import HOST

_TYPES = {
    "f": numba.float64, "s": numba.float32, "i": numba.int64, "U": numba.uint64,
    "u": numba.uint8, "w": numba.uint16, "b": numba.boolean,
    "c": numba.complex128, "j": numba.int32, "v": numba.uint32,
}  # fmt: skip

# A letter is a scalar type. With a digit it is an array of that many dimensions: C order, F order
# with T appended, any layout with A appended. Functions of a group share callees: one process
# compiles a group, because two processes that compile the same function at the same time would each
# overwrite the other's cache. Longest groups first.
_TABLE = """
ocmm_core.features.search._ellipse_kernel
    conics f2 f2
    of_conic f1 f f1
ocmm_core.features.search._newton_kernel
    descend i f2 f2 i f1
    gain_of f2T f2
    move i f1 f1 f1
    newton i f2 f1
    rank i f2 f2 f1
    terms i f2 f1 f1 f2T f2
    terms i f2 f1 f1 f2T f2A
    terms i f2 f1 f1 f2 f2
ocmm_core.features.search._search
    seen i f1 f2 f
ocmm_core.features.search._point_kernel
    centre f2 f1 f2
    line_distances f2 f2 f1 f1
    places f2 f2 f2T
    places f2 f2 f2
    principal f2 f1 f2
    spread f2 f2T f2T f2 f2
    spread f2 f2T f2 f2 f2
    spread f2 f2 f2T f2 f2
    spread f2 f2 f2 f2 f2
    spread_alike f3 f2T f2 f2
    spread_alike f3 f2 f2 f2
    taubin f2 f2
ocmm_core.features.search._starts_kernel
    circles f2 f2 f2
    flanks f2 f2
    quadric_feet f2 f2 f2
    tubes f2 f2
    narrowest_tube f2 f2
ocmm_core.features.zones._settle_kernel
    settle_zone i f b b i1 f2 f2 f1 f1 f2 f f i
    newton_step i f b b i1 f2 f1 f f1 f2 f2 i1 f1 f f1
ocmm_core.features.zones._distance_kernel
    zone_distances i f f2 f1 f1 f1 f2
    zone_distances i f c2 f1 c1 c1 c2
    possible_sizes i f1
    move_zone f2 f1 f1 f1 f2 f1 f1
ocmm_core.features.zones._kernel
    narrowest_zone f1 f2 f1 b f f1 i1 f1
ocmm_core.calibration.monitor._residual_samples
    spot_moments f4 b2 f3 f2 f2 f2 f4 f4
ocmm_core.measuring._pattern_field
    blocks i2 f3 f4
    bumps_of i2 f3
    gather f2 i3 f4 f4
    spread f3 i3 f4 f4 i
ocmm_core.tolerances.monte_carlo._refit_kernel
    refit i f2 f i1 f2 f1 f2 f2 f1

ocmm_cad.reach._search_kernel
    grow f3 f2 i2 i1
    search f2 f2 f f1 f4 i2 f2 f2 f2 f2 f2 f1 f3 i1 i1 i1 f2 i2 i1 i2 f1
ocmm_core.part_model._spline
    to_bezier f1 i i1 f3
ocmm_core.part_model._trimming
    nearest_stretch f2 f3 f1 f2
ocmm_cad.step._place_kernel
    spread f2 i1
    leans_inward f1 f1 f1 f2 f1
    distances f2 f3 f
    gaps_about f1 f1 f2
ocmm_cad.step.brep._surface_kernel
    closed_loops f2 i1
    inside f1 f1 f3 b2
    run_along i f2 f1 f i1 f2 i1 f1 f2 f2 f2 f1
    places_inside i f2 f1 f2 i1

ocmm_core.tracking._reference_body
    _follow b1 f3 f2 f3 f f1 f2 f1 f1 f3 f2 f1
ocmm_core.tracking.kernels._identify_kernel
    extend_tracked f3 f2 f2 f2 f2 f f f f1 i2
    without_rivals f4 f
    identify_frames f4 f2 f2 f2 i2 i1 i1 f3 f3 f1 f3 f3 i1 i2 b1 f f f1 u2 i4
ocmm_core.tracking.kernels._sensitivity_kernel
    answer_of_poses f4 f2 f2 u1 i1 i1 f3 f2 f3 f3 f3
ocmm_core.tracking.kernels._solve_kernel
    solve_frames f4 f2 f2 f1 f f i u1 f2 f3 f3 f2 f1 i1

ocmm_core.camera._centroid
    measure w2 i i w2 f1 f2 u2 i1 f1
ocmm_core.camera._search
    plan f2 i2 b f1 i1 i2
    sample w2 i2 i w2
    scan w2 i2 i w2 f2 i2 b f1
ocmm_core.camera._windows
    measure_windows w3 i2 w2 f2 f1 f2
    predict_windows f2 f1 i i i2
    report f2 f2 f2 u1
ocmm_genicam._client
    unpack_bits u1 i b w1
ocmm_sim.scene._exposure
    expose i i i i f2 f1 U U f f1 f2 w2
    mix U U
    run i f3 f1 U U f1 w2 f2 i1 i2 b f1 i w1 b1 u2 f3 f3
ocmm_sim.scene._kernels
    move f1 f2 f4 f3 f2 b1 b1
    see f3 f2 f2 f2 f f1 i1 f3 f3 U1 U1 f3
ocmm_sim.hand._kernel
    distance f1 f2 f2 f1
    drive f1 f1 f f f f2 f2 f2 f1 b1
    march f1 f1 f f f2 f2 f1 f1
ocmm_sim.scene._probe_study
    add_paths s2 s2 s2 f2 f1 i s2 f2 f3

ocmm_core.calibration.bundle._kernel
    back_substitute f3 f3 f2 f1 f2
    miss_frames f2 f2 f4 f3 f2 f4
    retract_poses f3 f2 f2
    schur_reduce_poses f2 f2 f1 f2 f i i f4 f3 i1 f3 f2 f f2 f1 f3 f3 f2 f2 f2
ocmm_core.calibration.cameras._lens
    project_points_with_jacobian f1 f2 f2 f2 f2 f3
    project_points_with_jacobian f1 f2 f2 f2T f2 f3
ocmm_core.calibration.pivot._kernel
    move_turns f3 f3 f2 f1 f3 f2
    schur_reduce_rotations f2 f2 f1 f4 f3 f f3 f2 f i1 f3 f2 f3 f3 f2 f2
    add_moments f3 f2 f2
    average_turned f3 f1 f2 f2
    fit_turns f2 f3 f3 f2 f1

ocmm_gui.scene._labels
    count_marks f2 f f f i2
    place_among f f f f f2 f2 f1 f1 f2 i2 f f
ocmm_gui.rendering._raster_kernel
    hides f2 j2 f1 f1 f
    project_mesh f2 f2 u2 f2 f1 f2 s2
    into_bands f2 j2 i i j1
    raster f2 s2 j2 j1 u1 f j1 i i i i s2 f s2 j2 v2
ocmm_gui.rendering._line_kernel
    blend_polygon f2 i f f s2 v2
    draw_discs f2 f1 j1 j1 f f f s2 v2
    draw_lines f2 j1 i i f i f f f s2 v2
    draw_segments f2 j1 f1 j1 f f s2 v2
    draw_outline s2 i i f i f i v2
    lay_ground i i i v2
    merge_layers v2 v2 i i f f
ocmm_gui.rendering._rendering
    paint_frame f2 f2 u2 j2 j1 u1 f2 j1 f2 f1 f b f2 s2 f2 f i f f f f i i s2 j2 v2
"""

Signature = tuple[Any, ...]


def kernel_groups() -> tuple[tuple[tuple[str, str, Signature], ...], ...]:
    """Return module, name and types of all functions, grouped by shared callees."""
    return tuple(tuple(_entries(group)) for group in _TABLE.strip().split("\n\n"))


def _entries(group: str) -> Iterator[tuple[str, str, Signature]]:
    module = ""
    for line in group.splitlines():
        first, *words = line.split()
        if line[0] != " ":
            module = first
        else:
            yield (module, first, tuple(map(_type_of, words)))


def _type_of(word: str) -> Any:  # numba ships no annotations
    scalar = _TYPES[word[0]]
    if len(word) == 1:
        return scalar
    return numba.types.Array(scalar, int(word[1]), {"": "C", "T": "F", "A": "A"}[word[2:]])


@dataclass(frozen=True, slots=True)
class Compilation:
    """Result of `compile_all`."""

    listed: int
    """Number of listed functions, counted per signature."""
    compiled: int
    """Functions compiled now, callees included; others were cached."""


def compile_all(processes: int | None = None) -> Compilation:
    """Compile all uncached functions, in `processes` or as many as there are cores."""
    wanted = kernel_groups()
    count = min(processes or HOST.processors(), len(wanted))
    if count == 1:
        compiled = sum(map(compile_group, range(len(wanted))))
    else:
        spawned = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(count, spawned, _collect_rarely) as pool:
            compiled = sum(pool.map(compile_group, range(len(wanted))))
    return Compilation(sum(map(len, wanted)), compiled)


def _collect_rarely() -> None:
    """Exclude loaded objects from garbage collection, which takes a tenth of the time."""
    gc.freeze()
    gc.set_threshold(100_000, 50, 100)


def compile_group(number: int) -> int:
    """Compile a group of the list, and return the number of compiled functions."""
    with event.install_recorder("numba:compile") as recorder:
        for module, name, types in kernel_groups()[number]:
            # A package of this program may be left out.
            if find_spec(module.partition(".")[0]) is None:
                continue
            getattr(import_module(module), name).compile(types)
    return sum(one.is_start for _, one in recorder.buffer)

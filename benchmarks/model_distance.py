"""Distances from faces of the model: how exact, and how long, beside the library of models.

    python -m benchmarks.model_distance [--points N] [--seed S]

Seeded points up to 3 mm off three free forms and five other faces; distances by the product, by the
library's extrema of shapes (BRepExtrema_DistShapeShape) and by its projections
(GeomAPI_ProjectPointOnSurf). Points of which the product says that they are none to measure with
are left out of the differences, and counted. Needs the extra `step`. Ends with 1 if a difference to
the extrema is more than 0.1 micrometres.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from ocmm_core.blas import use_one_thread
from ocmm_core.part_model import nearest_feet, normals_at, places_at, searched_face
from tests.core.part_model.model_faces import (
    FREE_FORMS,
    analytic_faces,
    face_of,
    in_library,
    library_distances,
    projected_distances,
    whole_face,
)

LIMIT_MM = 1e-4
_FAR_MM = 3.0


def main() -> int:
    """Print the table; return 1 if a distance is off."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=18)
    asked = parser.parse_args()
    use_one_thread()
    rng = np.random.default_rng(asked.seed)
    faces = {name: (make(), whole_face(make())) for name, make in FREE_FORMS.items()}
    faces |= analytic_faces()
    print(f"{asked.points} points a face; us a point; differences in nm")
    head = ("face", "doubted", "to extrema", "to projection", "ready ms", "us", "extrema", "ratio")
    print("  ".join(f"{word:>13}" for word in head))
    worst = 0.0
    for name, (spline, face) in faces.items():
        begin = time.process_time()
        made = searched_face(face_of(spline))
        ready = time.process_time() - begin
        surface = made.surface
        at = surface.low + (surface.high - surface.low) * rng.uniform(size=(asked.points, 2))
        off = rng.uniform(-_FAR_MM, _FAR_MM, (asked.points, 1))
        points = places_at(surface, at) + off * normals_at(surface, at)
        begin = time.process_time()
        found = nearest_feet(points, [made])
        own = time.process_time() - begin
        begin = time.process_time()
        extrema = library_distances(points, face)
        theirs = time.process_time() - begin
        projected = projected_distances(points, in_library(spline))
        good = np.array([doubt == "" for doubt in found.doubts])
        distances = np.abs(found.distances)
        to_extrema = float(np.abs(distances - extrema)[good].max())
        to_projection = float(np.abs(distances - projected)[good].max())
        worst = max(worst, to_extrema)
        row = (
            name, f"{np.count_nonzero(~good)}", f"{1e6 * to_extrema:.4f}",
            f"{1e6 * to_projection:.4f}", f"{1e3 * ready:.0f}",
            f"{1e6 * own / asked.points:.0f}", f"{1e6 * theirs / asked.points:.0f}",
            f"{own / theirs:.2f}",
        )  # fmt: skip
        print("  ".join(f"{word:>13}" for word in row))
    return 0 if worst <= LIMIT_MM else 1


if __name__ == "__main__":
    sys.exit(main())

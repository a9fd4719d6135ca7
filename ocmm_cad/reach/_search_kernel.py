"""Compiled: first collision-free attitude that enough cameras see; all in the part frame."""

from __future__ import annotations

import numpy as np

from ocmm_cad.reach import _tree_kernel as tree
from ocmm_cad.reach._tree_kernel import FREE, PartMesh, first_near
from ocmm_core.camera import compiled
from ocmm_core.geometry import Float, Int

FOUND, BALL, STYLUS, BODY, SIGHT = range(5)
"""Progress of the search: obstacle of the attitude that came farthest."""

NOBODY = -2
"""A surface without faces: all faces are obstacles to the body."""
_LINE_MM = 2.0
"""Clear radius about the line from an LED to a camera, that of its lens."""
# Columns of the limits, mm except for the cosine and the number.
BALL_GAP, OWN_GAP, STYLUS_GAP, BODY_GAP, STEP, COS_EMISSION, LEAST_LEDS = range(7)
N_LIMITS = 7


@compiled(tree)
def _ball_way(
    point: Float, normal: Float, radius: float, ways: Float, limits: Float, ball: Float,
    mesh: PartMesh, own: int,
) -> tuple[float, int]:  # fmt: skip
    """Return the longest free of decreasing ways (w,), mm, along the normal; 0 and the face hit."""
    face = FREE
    ball[:] = 0.0
    ball[tree.AT_START], ball[tree.AT_END] = radius, radius
    for k in range(len(ways)):
        for a in range(3):
            ball[tree.START + a] = point[a] + radius * normal[a]
            ball[tree.END + a] = point[a] + (radius + ways[k]) * normal[a]
        face = first_near(ball, limits[BALL_GAP], limits[OWN_GAP], mesh, own)
        if face == FREE:
            return ways[k], FREE
    return 0.0, face


@compiled(tree)
def _hit(
    part: int, bodies: Float, turn: Float, centre: Float, normal: Float, way: float, limits: Float,
    body: Float, mesh: PartMesh,
) -> int:  # fmt: skip
    """Return a face that a part of the probe touches on the way of the ball, or FREE.

    ``turn`` (3, 3): part from probe. ``centre`` (3,): of the ball at the touch.
    """
    gap = limits[STYLUS_GAP] if part == 0 else limits[BODY_GAP]
    steps = max(1, int(np.ceil(way / limits[STEP])))
    for step in range(steps + 1):
        back = way * step / steps
        for row in range(len(bodies)):
            if bodies[row, tree.PART] != part:
                continue
            body[:] = bodies[row]
            for a in range(3):
                start, end, across = centre[a] + back * normal[a], centre[a] + back * normal[a], 0.0
                for b in range(3):
                    start += turn[a, b] * bodies[row, tree.START + b]
                    end += turn[a, b] * bodies[row, tree.END + b]
                    across += turn[a, b] * bodies[row, tree.ACROSS + b]
                body[tree.START + a], body[tree.END + a] = start, end
                body[tree.ACROSS + a] = across
            face = first_near(body, gap, gap, mesh, NOBODY)
            if face != FREE:
                return face
    return FREE


@compiled(tree)
def leds_seen(
    turn: Float, centre: Float, leds: Float, directions: Float, cameras: Float, sensors: Float,
    limits: Float, ray: Float, mesh: PartMesh, through: bool,
) -> int:  # fmt: skip
    """Return the number of LEDs seen by two or more cameras, ignoring the part if ``through``.

    ``leds`` (L, 3) from the ball, and ``directions`` (L, 3), probe frame. ``cameras`` (c, 21): as
    `CameraModel.packed`, for points of the part. ``sensors`` (c, 2): last column and row, px.
    """
    by_two = 0
    p, light, eye = np.empty(3), np.empty(3), np.empty(3)
    ray[:] = 0.0
    ray[tree.AT_START], ray[tree.AT_END] = _LINE_MM, _LINE_MM
    for n in range(len(leds)):
        cameras_of_it = 0
        for a in range(3):
            p[a], light[a] = centre[a], 0.0
            for b in range(3):
                p[a] += turn[a, b] * leds[n, b]
                light[a] += turn[a, b] * directions[n, b]
        for c in range(len(cameras)):
            m = cameras[c]
            towards, away2 = 0.0, 0.0
            for a in range(3):
                # C = -R't, centre of the camera.
                eye[a] = -(m[a] * m[9] + m[3 + a] * m[10] + m[6 + a] * m[11])
                towards += light[a] * (eye[a] - p[a])
                away2 += (eye[a] - p[a]) ** 2
            z = m[6] * p[0] + m[7] * p[1] + m[8] * p[2] + m[11]
            if towards < limits[COS_EMISSION] * np.sqrt(away2) or z <= 0.0:
                continue
            # As `camera.project`: ideal image, mm; distortion; pixels.
            x = m[12] * (m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[9]) / z
            y = m[12] * (m[3] * p[0] + m[4] * p[1] + m[5] * p[2] + m[10]) / z
            r2 = x * x + y * y
            radial = r2 * (m[17] + m[18] * r2)
            u = x + x * radial + 2.0 * m[19] * x * y + m[20] * (3.0 * x * x + y * y)
            v = y + y * radial + m[19] * (x * x + 3.0 * y * y) + 2.0 * m[20] * x * y
            u, v = m[15] + m[13] * u, m[16] + m[14] * v
            if not (0.0 <= u <= sensors[c, 0] and 0.0 <= v <= sensors[c, 1]):
                continue
            for a in range(3):
                ray[tree.START + a], ray[tree.END + a] = p[a], eye[a]
            if through or first_near(ray, 0.0, 0.0, mesh, NOBODY) == FREE:
                cameras_of_it += 1
        if cameras_of_it >= 2:
            by_two += 1
    return by_two


@compiled(tree)
def _is_among(d: int, ranks: Int) -> bool:
    """Return whether a direction is in the more natural half of the tried ones."""
    count = 0
    found = -1
    for rank in range(len(ranks)):
        if ranks[rank] < 0:
            break
        if ranks[rank] == d:
            found = rank
        count += 1
    return found >= 0 and 2 * found < count


@compiled(tree)
def search(
    points: Float, normals: Float, radius: float, ways: Float, turns: Float, ranks: Int,
    bodies: Float, leds: Float, directions: Float, cameras: Float, sensors: Float, limits: Float,
    triangles: Float, faces: Int, surfaces: Int, own: Int, boxes: Float, links: Int, order: Int,
    found: Int, way_of: Float,
) -> None:  # fmt: skip
    """Fill in the progress of the search and its attitude for each target.

    ``points``, ``normals`` (n, 3). ``turns`` (d, y, 3, 3): part from probe, for directions of the
    handle and turns about it. ``ranks`` (n, d): directions, the most natural first; -1 ends them.
    ``surfaces`` (f,): of each face; ``own`` (n,): of each target, equal ones consecutive. ``found``
    (n, 5): stage, face against it, direction, turn, LEDs seen by two cameras; ``way_of`` (n,), mm,
    free along the normal. Without cameras (0, 21) sight is not checked.
    """
    mesh = PartMesh(triangles, faces, surfaces, boxes, links, order)
    body = np.empty(tree.N_COLUMNS)
    centre = np.empty(3)
    facing = np.zeros(turns.shape[1], dtype=np.int64)
    last = -1
    for i in range(len(points)):
        found[i, 0], found[i, 1], found[i, 2], found[i, 3], found[i, 4] = BALL, FREE, -1, -1, 0
        if i > 0 and own[i] != own[i - 1]:
            last = -1
        way, face = _ball_way(points[i], normals[i], radius, ways, limits, body, mesh, own[i])
        way_of[i] = way
        if face != FREE:
            found[i, 1] = face
            continue
        for a in range(3):
            centre[a] = points[i, a] + radius * normals[i, a]
        done, turned_away = False, True
        # Without a body only the ball is checked.
        if len(bodies) == 0:
            found[i, 0] = FOUND
            done = True
        # Try the previous target's attitude first, if it is natural here also.
        for rank in range(-1, ranks.shape[1]):
            if done:
                break
            d = ranks[i, rank] if rank >= 0 else last
            if d < 0 and rank >= 0:
                break
            if d < 0 or (rank >= 0 and d == last) or (rank < 0 and not _is_among(d, ranks[i])):
                continue
            if len(cameras):
                # Counting without the part first is cheap: most attitudes turn the LEDs away.
                most = 0
                for y in range(turns.shape[1]):
                    count = leds_seen(
                        turns[d, y], centre, leds, directions, cameras, sensors, limits, body,
                        mesh, True,
                    )  # fmt: skip
                    facing[y] = count
                    most = max(most, count)
                if most < limits[LEAST_LEDS]:
                    found[i, 4] = max(found[i, 4], most)
                    continue
                turned_away = False
            # Stylus and core of the body are round: rotations about their axis do not matter.
            face = _hit(0, bodies, turns[d, 0], centre, normals[i], way, limits, body, mesh)
            if face != FREE:
                if found[i, 0] < STYLUS:
                    found[i, 0], found[i, 1] = STYLUS, face
                continue
            face = _hit(2, bodies, turns[d, 0], centre, normals[i], way, limits, body, mesh)
            if face != FREE:
                if found[i, 0] < BODY:
                    found[i, 0], found[i, 1] = BODY, face
                continue
            for y in range(turns.shape[1]):
                count = 0
                if len(cameras):
                    if facing[y] < limits[LEAST_LEDS]:
                        continue
                    count = leds_seen(
                        turns[d, y], centre, leds, directions, cameras, sensors, limits, body,
                        mesh, False,
                    )  # fmt: skip
                    if count < limits[LEAST_LEDS]:
                        if found[i, 0] < SIGHT or count > found[i, 4]:
                            found[i, 0], found[i, 1], found[i, 4] = SIGHT, FREE, count
                        continue
                face = _hit(1, bodies, turns[d, y], centre, normals[i], way, limits, body, mesh)
                if face != FREE:
                    if found[i, 0] < BODY:
                        found[i, 0], found[i, 1] = BODY, face
                    continue
                found[i, 0], found[i, 1], found[i, 2], found[i, 3] = FOUND, FREE, d, y
                found[i, 4] = count
                last = d
                done = True
                break
        if not done and turned_away and len(cameras):
            found[i, 0], found[i, 1] = SIGHT, FREE


_LEAF = 4
"""Triangles per leaf."""


@compiled()
def _part_at(wanted: int, low: int, high: int, keys: Float, order: Int) -> None:
    """Partition rows ``low`` to ``high`` about ``wanted`` (Hoare's selection, linear time)."""
    while low < high:
        mark = keys[order[(low + high) // 2]]
        i, j = low, high
        while i <= j:
            while keys[order[i]] < mark:
                i += 1
            while keys[order[j]] > mark:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i += 1
                j -= 1
        if wanted <= j:
            high = j
        elif wanted >= i:
            low = i
        else:
            return


@compiled()
def grow(triangles: Float, boxes: Float, links: Int, order: Int) -> int:
    """Fill in the tree of ``triangles`` (n, 3, 3), and return its number of boxes.

    ``boxes`` (2 n, 6): least and greatest coordinates. ``links`` (2 n, 2): the first of two
    consecutive children, and -1; or first and number of a leaf's triangles in ``order`` (n,).
    """
    n = len(triangles)
    middles = np.empty((n, 3))
    for i in range(n):
        order[i] = i
        for a in range(3):
            middles[i, a] = triangles[i, 0, a] + triangles[i, 1, a] + triangles[i, 2, a]
    first = np.empty(2 * n, dtype=np.int64)
    last = np.empty(2 * n, dtype=np.int64)
    first[0], last[0] = 0, n
    count = 1
    box = 0
    while box < count:
        low, high = first[box], last[box]
        for a in range(3):
            boxes[box, a], boxes[box, 3 + a] = np.inf, -np.inf
        for k in range(low, high):
            for corner in range(3):
                for a in range(3):
                    x = triangles[order[k], corner, a]
                    boxes[box, a] = min(boxes[box, a], x)
                    boxes[box, 3 + a] = max(boxes[box, 3 + a], x)
        if high - low <= _LEAF:
            links[box, 0], links[box, 1] = low, high - low
        else:
            longest = 0
            for a in range(1, 3):
                if (
                    boxes[box, 3 + a] - boxes[box, a]
                    > boxes[box, 3 + longest] - boxes[box, longest]
                ):
                    longest = a
            # The median halves the count, so that the depth is log2 of it.
            half = (low + high) // 2
            _part_at(half, low, high - 1, middles[:, longest], order)
            links[box, 0], links[box, 1] = count, -1
            first[count], last[count] = low, half
            first[count + 1], last[count + 1] = half, high
            count += 2
        box += 1
    return count

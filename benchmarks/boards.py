"""Coverage of U by cameras calibrated with a board, and the errors of OpenCV beside.

    python -m benchmarks.boards [--rigs N] [--seed S] [--noise PX] [--common PX] [--hard]
        [--recorded POSES] [--lens K3,S1,S2]

Every rig has its own cameras, board and views (`tests.boards.board_scene`); ``--common`` moves all
corners of a picture together, ``--hard`` takes cheap lenses, a printed board and few views,
``--recorded`` adds a waved probe and a bar to the bundle, ``--lens`` are terms of the true lenses
beyond the model. Lengths of 300 mm all over the volume are located from exact spots,
so what is left is the calibration. OpenCV gets the same corners and the nominal board
(`calibrateCamera` for each camera, then `stereoCalibrate` of all from there); it states no
uncertainty of a length. Ends with 1 if fewer than 92 % of the lengths lie within U.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from ocmm_core.blas import use_one_thread

use_one_thread()

import cv2  # noqa: E402 - the number of BLAS threads is set before numpy is loaded
import numpy as np  # noqa: E402 - as above

from ocmm_boards import calibrate_with_board  # noqa: E402 - as above
from ocmm_core.calibration.guided import random_lines  # noqa: E402 - as above
from ocmm_core.errors import CalibrationError  # noqa: E402 - as above
from ocmm_core.geometry import Float  # noqa: E402 - as above
from tests.boards.board_scene import (  # noqa: E402 - as above
    LENGTH_MM,
    Scene,
    hard_scene,
    length_errors,
    recorded,
    scene,
    true_spots,
)  # fmt: skip

LINES = 100
LEAST_SHARE = 0.92
LEAST_CORNERS = 12


def opencv_errors(one: Scene, seed: int) -> Float:
    """Return errors (n,), mm, of the lengths that `benchmarks.boards` asks for, by OpenCV."""
    peer: Any = cv2
    board, uv = one.board.corners.astype(np.float32), one.views.uv
    size = (one.nominal.cameras[0].width, one.nominal.cameras[0].height)
    seen = one.views.seen
    lenses = []
    for index, nominal in enumerate(one.nominal.cameras):
        views = np.flatnonzero(seen[:, index].sum(axis=1) >= LEAST_CORNERS).tolist()
        focal = nominal.focal / nominal.pitch_mm
        start = np.array([[focal, 0.0, size[0] / 2], [0.0, focal, size[1] / 2], [0.0, 0.0, 1.0]])
        _, matrix, lens, _, _ = peer.calibrateCamera(
            [board[seen[view, index]] for view in views],
            [uv[view, index, seen[view, index]].astype(np.float32) for view in views],
            size, start, None, flags=peer.CALIB_USE_INTRINSIC_GUESS | peer.CALIB_FIX_K3,
        )  # fmt: skip
        lenses.append((matrix, lens))
    both = np.all(seen, axis=1)
    views = np.flatnonzero(both.sum(axis=1) >= LEAST_CORNERS).tolist()
    (first, first_lens), (second, second_lens) = lenses
    _, first, first_lens, second, second_lens, rotation, shift, _, _ = peer.stereoCalibrate(
        [board[both[view]] for view in views],
        [uv[view, 0, both[view]].astype(np.float32) for view in views],
        [uv[view, 1, both[view]].astype(np.float32) for view in views],
        first, first_lens, second, second_lens, size,
        flags=peer.CALIB_USE_INTRINSIC_GUESS | peer.CALIB_FIX_K3,
    )  # fmt: skip
    ends = random_lines(one.true.volume_world, LENGTH_MM, LINES, seed).reshape(-1, 3)
    spots = [true_spots(camera, ends, one.extra)[:, None] for camera in one.true.cameras]
    lenses = [(first, first_lens), (second, second_lens)]
    flat = [
        peer.undistortPoints(of_camera, matrix, lens)[:, 0].T
        for of_camera, (matrix, lens) in zip(spots, lenses, strict=True)
    ]
    located = peer.triangulatePoints(
        np.eye(3, 4), np.hstack([rotation, shift.reshape(3, 1)]), *flat
    )
    pairs = (located[:3] / located[3]).T.reshape(-1, 2, 3)
    errors: Float = np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1) - LENGTH_MM
    return errors


def main() -> int:
    """Print the shares and the errors; return 0 if enough lengths lie within U."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rigs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--noise", type=float, default=0.05)
    parser.add_argument("--common", type=float, default=0.0)
    parser.add_argument("--hard", action="store_true")
    parser.add_argument("--recorded", type=int)
    parser.add_argument("--lens", default="0,0,0")
    options = parser.parse_args()
    k3, s1, s2 = (float(part) for part in options.lens.split(","))
    ours, theirs, stated, refused, joint = [], [], [], [], []
    with tempfile.TemporaryDirectory() as name:
        for seed in range(options.seed, options.seed + options.rigs):
            folder = Path(name)
            if options.hard:
                one = hard_scene(folder, seed)
            else:
                one = scene(
                    folder, seed, views=50, noise_px=options.noise, common_px=options.common,
                    extra=(k3, s1, s2),
                )  # fmt: skip
            spots = None
            if options.recorded is not None:
                spots = recorded(one, seed, poses=options.recorded)
            found = []
            for more in (None, spots)[: 1 if spots is None else 2]:
                try:
                    found.append(
                        calibrate_with_board(one.nominal, one.board, one.views, True, more).found
                    )
                except CalibrationError as error:
                    refused.append(f"{seed}: {error.code}")
            if len(found) < 1 + (spots is not None):
                continue
            rigs = [
                replace(one.nominal, cameras=each.cameras, parameter_covariance=each.covariance)
                for each in found
            ]
            errors, sigmas = length_errors(rigs[0], one.true, seed, LINES, one.extra)
            joint += [length_errors(rig, one.true, seed, LINES, one.extra) for rig in rigs[1:]]
            ours.append(errors)
            stated.append(sigmas)
            theirs.append(opencv_errors(one, seed))
    if not ours:
        print(f"{options.rigs} rigs, all refused: {', '.join(refused)}")
        return 1
    ratios = np.abs(np.concatenate(ours)) / (2.0 * np.concatenate(stated))
    share = float(np.mean(ratios <= 1.0))
    rms = [1e3 * float(np.sqrt(np.mean(np.square(e)))) for e in ours]
    peer = [1e3 * float(np.sqrt(np.mean(np.square(e)))) for e in theirs]
    better = sum(a <= 1.05 * b for a, b in zip(rms, peer, strict=True))
    print(f"{len(ours)} of {options.rigs} rigs, {len(ratios)} lengths of {LENGTH_MM:g} mm")
    print(
        f"within U (k = 2): {100 * share:.1f} %; U {2e3 * np.mean(np.concatenate(stated)):.1f} um"
    )
    print(
        f"RMS error, median of the rigs: {np.median(rms):.1f} um, OpenCV {np.median(peer):.1f} um"
    )
    print(f"no more than 5 % worse than OpenCV: {better} of {len(ours)} rigs")
    if joint:
        ratio = np.abs(np.concatenate([e / (2.0 * s) for e, s in joint]))
        rms_joint = [1e3 * float(np.sqrt(np.mean(np.square(e)))) for e, _ in joint]
        share = min(share, float(np.mean(ratio <= 1.0)))
        worse = sum(a > b for a, b in zip(rms_joint, rms, strict=True))
        print(
            f"with probe and bar: {100 * np.mean(ratio <= 1.0):.1f} % within U; U "
            f"{2e3 * np.mean([s for _, s in joint]):.1f} um; RMS error {np.median(rms_joint):.1f} "
            f"um; worse than the board alone: {worse}"
        )
    if refused:
        print(f"refused: {', '.join(refused)}")
    return 0 if share >= LEAST_SHARE else 1


if __name__ == "__main__":
    sys.exit(main())

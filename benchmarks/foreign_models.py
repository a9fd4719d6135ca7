"""Import of STEP models of many kinds: targets off their faces or in a hole, refusals, lost faces.

    python -m benchmarks.foreign_models [--turns N] [--seed S] [MODEL ...]

Makes models of each kind of the tests in any attitude and unit (mm, inch, m), each also mirrored,
a tenth and twenty times as large, with damaged faces, and as assemblies over several files, and
adds the files given. The library reads each file again and measures the distance of each target
from the trimmed faces. Needs the extra `step`. Ends with 1 if a target is off by more than 0.05 mm,
a face is not in the account, or an import fails otherwise than with a sentence.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.random import Generator

from ocmm_cad.step import Choice, chosen, faces_account, model_files, offers_of, read_model
from ocmm_cad.step.brep import read_document
from ocmm_core.errors import OcmmError
from tests.cad.step_models import off_mm, written
from tests.cad.whole_step_models import (
    GOOD,
    MORE,
    ODD,
    as_splines,
    bored_plate,
    cut_sphere,
    split_plate,
    turned,
    windowed_tube,
)

LIMIT_MM = 0.05
Write = Callable[[Path, Generator], Path]


def changed(
    make: Callable[[Generator], object], *, size: float = 1.0, mirror: bool = False
) -> Write:
    """Return what writes a shape that is scaled or mirrored."""

    def write(path: Path, rng: Generator) -> Path:
        from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
        from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf

        motion = gp_Trsf()
        if mirror:
            motion.SetMirror(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0.48, 0.6, 0.64)))
        else:
            motion.SetScale(gp_Pnt(0, 0, 0), size)
        shape = BRepBuilderAPI_Transform(turned(make(rng), rng), motion, True).Shape()
        return written(path, shape, str(rng.choice(["MM", "INCH", "M"])))

    return write


SHAPES: dict[str, Callable[[Generator], object]] = {
    "split plate": split_plate, "bored plate": bored_plate, "window": windowed_tube,
    "cut sphere": cut_sphere, "splines": lambda rng: as_splines(bored_plate(rng)),
}  # fmt: skip
KINDS: dict[str, Write] = {
    **GOOD, **MORE, **{f"damaged {name}": write for name, write in ODD.items()},
    **{f"mirrored {name}": changed(make, mirror=True) for name, make in SHAPES.items()},
    **{f"small {name}": changed(make, size=0.1) for name, make in SHAPES.items()},
    **{f"large {name}": changed(make, size=20.0) for name, make in SHAPES.items()},
}  # fmt: skip


def main() -> int:
    """Print a line for each model and the sums; return 1 if one is wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--turns", type=int, default=4)
    parser.add_argument("--seed", type=int, default=37)
    parser.add_argument("models", nargs="*", type=Path)
    options = parser.parse_args()
    counts = dict.fromkeys(("models", "refused", "crashed", "targets", "off", "lost faces"), 0)
    worst = 0.0
    wanted = [(f"{name} {turn}", name, turn) for turn in range(options.turns) for name in KINDS]
    with tempfile.TemporaryDirectory() as folder:
        # The writer of assemblies writes part files into the working directory.
        os.chdir(folder)
        for number, (label, name, turn) in enumerate(
            [*wanted, *((m.name, "", 0) for m in options.models)]
        ):
            if name:
                rng = np.random.default_rng([options.seed, turn, *map(ord, name)])
                path = KINDS[name](Path(folder) / f"{number}" / "model.stp" if name == "assembly"
                                   else Path(folder) / f"model{number}.stp", rng)  # fmt: skip
            else:
                path = next(one for one in options.models if one.name == label)
            counts["models"] += 1
            start = time.monotonic()
            try:
                model = read_model(path)
            except OcmmError as error:
                counts["refused"] += 1
                print(f"{label:28} refused: {error.what[:90]}", flush=True)
                continue
            except Exception as error:
                counts["crashed"] += 1
                print(f"{label:28} CRASHED: {error!r}", flush=True)
                continue
            everything = Choice(everything=True, profiles=True)
            account = faces_account(model, chosen(offers_of(model), everything))
            lost = account.faces - account.taken - sum(count for _, count in account.left_out)
            places = [one for item in model.features for one in item.targets]
            places += [one for form in model.free_forms for one in form.targets]
            off = 0.0
            if places and not name.startswith("damaged"):
                files = tuple(sorted(model_files(path).parts))
                whole = written(
                    Path(folder) / "whole.stp", read_document(str(path), print, files).shape
                )
                distances = off_mm(whole, places)
                off = float(distances.max())
                counts["off"] += int((distances > LIMIT_MM).sum())
            counts["targets"] += len(places)
            counts["lost faces"] += lost
            worst = max(worst, off)
            print(
                f"{label:28} {len(model.features):4} features, {len(places):5} targets, "
                f"{off:.5f} mm off, {time.monotonic() - start:.1f} s", flush=True,
            )  # fmt: skip
    print(", ".join(f"{value} {name}" for name, value in counts.items()), f"worst {worst:.5f} mm")
    return int(bool(counts["off"] or counts["crashed"] or counts["lost faces"]))


if __name__ == "__main__":
    raise SystemExit(main())

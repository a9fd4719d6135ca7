"""Install the wheel without extras, then with each extra alone, into empty environments.

The core must fit points without any extra: size of the environment (and without bytecode), and time
of the import of the fits, the median of some processes. A command that needs an extra must end with
2 and print the line that installs it. Each extra alone must import.
The limits: 250 MB and 0.3 s.
Run: ``python -m benchmarks.core_only [--wheel FILE] [--extras gui,bus,...] [--work DIR]``.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
EXTRAS = {
    "gui": "import PySide6.QtWidgets, pyqtgraph, ocmm_gui.app",
    "bus": "import ocmm_core.fieldbus.wire._master",
    "token": "import pkcs11",
    "sensors": "import serial, pymodbus.client, paho.mqtt.client",
    "shop": "from ocmm_shop.cluster import DASK; import psycopg, pyarrow",
    "step": "from ocmm_cad.step import has_step; assert has_step()",
}
"""What each must import."""
MISSING = {
    "gui": "window --language en",
    "bus": "measure --source ethercat:lo --plan {plan}",
    "shop": "archive verify --archive postgresql://nobody@127.0.0.1:1/none",
    "step": "plan import {step} --output plan.toml --name N --part P",
}
"""A command of each extra, for an environment that lacks it."""
_FIT = (
    "import time; wall, cpu = time.perf_counter(), time.process_time()\n"
    "from ocmm_core.features import Shape, fit, fit_shape\n"
    "print(time.perf_counter() - wall, time.process_time() - cpu)\n"
    "import sys; assert 'numba' not in sys.modules\n"
    "if len(sys.argv) > 1:\n"
    "    import numpy as np; rng = np.random.default_rng(1); p = rng.normal(size=(50, 3))\n"
    "    p = 10 * p / np.linalg.norm(p, axis=1)[:, None] + [1, 2, 3]\n"
    "    assert abs(fit(Shape.SPHERE, p).diameter - 20) < 1e-9\n"
)
IMPORTS = 7
_MB = 1e6


def _run(*command: str | Path, folder: Path) -> subprocess.CompletedProcess[str]:
    plain = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return subprocess.run(  # noqa: S603 - of the environment made here
        [*map(str, command)], cwd=folder, capture_output=True, text=True, check=False,
        env={**plain, "HOME": str(folder), "QT_QPA_PLATFORM": "offscreen"},
    )  # fmt: skip


def _done(*command: str | Path, folder: Path) -> str:
    done = _run(*command, folder=folder)
    if done.returncode:
        raise SystemExit(f"{command}: {done.stdout}{done.stderr}")
    return done.stdout


def _environment(folder: Path, wheel: Path, extra: str = "") -> Path:
    """Return the folder of programs of a new environment with the wheel and one extra."""
    uv: list[str | Path] = [
        sys.executable,
        "-m",
        "uv",
        "--quiet",
        "--cache-dir",
        folder.with_name("cache"),
    ]
    _done(*uv, "venv", "--python", sys.executable, folder, folder=folder.parent)
    # Bytecode as pip compiles it.
    more = () if extra else ("--compile-bytecode",)
    wanted = f"{wheel}[{extra}]" if extra else str(wheel)
    python = folder / "bin/python"
    _done(*uv, "pip", "install", "--python", python, *more, wanted, folder=folder)
    return folder / "bin"


def core(folder: Path, wheel: Path) -> bool:
    """Print size, time of the import and answers without extras; return whether all is well."""
    programs = _environment(folder, wheel)
    (packages,) = (folder / "lib").glob("python*/site-packages")
    sizes = {path: path.stat().st_size for path in packages.rglob("*") if path.is_file()}
    source = sum(size for path, size in sizes.items() if path.suffix != ".pyc")
    _done(programs / "python", "-c", _FIT, "fit", folder=folder)
    times = [
        [*map(float, _done(programs / "python", "-c", _FIT, folder=folder).split())]
        for _ in range(IMPORTS)
    ]
    wall, processor = (statistics.median(column) for column in zip(*times, strict=True))
    sys.stdout.write(
        f"core: {sum(sizes.values()) / _MB:.0f} MB, {source / _MB:.0f} MB without bytecode "
        f"(limit 250); import {wall:.2f} s, {processor:.2f} s of a processor, medians of "
        f"{IMPORTS} (limit 0.3)\n"
    )
    largest: dict[str, int] = {}
    for path, size in sizes.items():
        name = path.relative_to(packages).parts[0]
        largest[name] = largest.get(name, 0) + size
    for name in sorted(largest, key=lambda one: -largest[one])[:6]:
        sys.stdout.write(f"    {largest[name] / _MB:6.0f} MB  {name}\n")
    (folder / "part.step").write_text("ISO-10303-21;\n", "utf-8")
    plan = packages / "ocmm_core/resources/plans/quick.toml"
    well = True
    for extra, words in MISSING.items():
        given = words.format(plan=plan, step=folder / "part.step").split()
        done = _run(programs / "ocmm", *given, folder=folder)
        line = f"pip install 'ocmm[{extra}]'"
        good = done.returncode == 2 and line in " ".join(done.stderr.split())
        well &= good
        sys.stdout.write(f"without {extra}: {'named' if good else f'NOT NAMED: {done}'}\n")
    return well and processor <= 0.3


def main() -> int:
    """Measure, and return 1 if something is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wheel", type=Path)
    parser.add_argument("--extras", default=",".join(EXTRAS))
    parser.add_argument("--work", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=given.work) as name:
        work = Path(name)
        wheel = given.wheel and given.wheel.resolve()
        if wheel is None:
            _done(
                sys.executable, "-m", "pip", "--quiet", "wheel", "--no-deps", "--wheel-dir", work,
                ROOT, folder=work,
            )  # fmt: skip
            (wheel,) = work.glob("*.whl")
        well = core(work / "core", wheel)
        for extra in filter(None, given.extras.split(",")):
            folder = work / extra
            done = _run(
                _environment(folder, wheel, extra) / "python", "-c", EXTRAS[extra], folder=folder
            )
            well &= done.returncode == 0
            words = "imports" if done.returncode == 0 else f"does NOT import: {done.stderr[-300:]}"
            sys.stdout.write(f"ocmm[{extra}]: {words}\n")
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())

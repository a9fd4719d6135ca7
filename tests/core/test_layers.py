"""The house keeps its layers: contracts, no Qt in the core, nothing heavy in the bus process."""

from __future__ import annotations

import pkgutil
import subprocess
import sys
from pathlib import Path

import ocmm_core
from tests.host import HANG_S

_REPOSITORY = Path(__file__).resolve().parents[2]
_LIGHT = ("scipy.__config__", "scipy._", "scipy.version")
_IMPORT_ALL = """
import importlib, sys
for name in sys.argv[2:]:
    importlib.import_module(name)
banned = sys.argv[1].split(",")
print(*sorted(m for m in sys.modules if m.partition(".")[0] in banned))
"""


def _loaded(banned: str, modules: list[str]) -> list[str]:
    """Import ``modules`` in a fresh interpreter and return which of ``banned`` came with them."""
    done = subprocess.run(
        [sys.executable, "-c", _IMPORT_ALL, banned, *modules],
        cwd=_REPOSITORY,
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def _core_modules() -> list[str]:
    found = pkgutil.walk_packages(ocmm_core.__path__, prefix="ocmm_core.")
    # A __main__ runs its program when it is imported.
    return [module.name for module in found if not module.name.endswith("__main__")]


def test_contracts_of_pyproject_hold() -> None:
    done = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache"],
        cwd=_REPOSITORY,
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_core_module_imports_without_qt_and_packages_of_scipy() -> None:
    modules = _core_modules()
    assert "ocmm_core.acquisition.frames._ring" in modules
    loaded = _loaded("PySide6,shiboken6,pyqtgraph,scipy", modules)
    # `import scipy` loads its packages on first use: together a third of a second of each start.
    assert [name for name in loaded if name != "scipy" and not name.startswith(_LIGHT)] == []


def test_the_probe_of_loaded_modules_finds_what_is_there() -> None:
    assert "json" in _loaded("json", ["json"])


def test_bus_process_loads_nothing_heavy() -> None:
    banned = "scipy,numba,llvmlite,PySide6,shiboken6,pyqtgraph,rich,typer"
    assert _loaded(banned, ["ocmm_core.acquisition.bus_process._process"]) == []

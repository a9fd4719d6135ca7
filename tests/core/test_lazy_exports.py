"""Public APIs of packages: consistent lists that load, and no imports of inner modules."""

from __future__ import annotations

import ast
import inspect
import re
import sys
import types
from importlib import import_module
from pathlib import Path

import pytest
from grimp import ImportGraph

from benchmarks.house_faces import written
from benchmarks.house_tree import ROOTS
from ocmm_core.lazy_exports import lazy_exports
from tests.package_imports import inner_imports_from_outside, inner_imports_inside, package_of

REPOSITORY = Path(__file__).resolve().parents[2]
FACES = {
    ".".join(path.relative_to(REPOSITORY).parent.parts): path
    for root in ROOTS
    for path in sorted((REPOSITORY / root).rglob("__init__.py"))
}
HOMES = dict[str, str]
"""The module that defines each name; for a name that is a module, its package."""


def for_type_checkers(package: str, tree: ast.Module) -> HOMES:
    """Return the names under TYPE_CHECKING."""
    found = {}
    for node in tree.body:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            for one in node.body:
                assert isinstance(one, ast.ImportFrom)
                for alias in one.names:
                    name = alias.asname or alias.name
                    assert name not in found
                    assert name == alias.name or (one.module, alias.name) == (package, f"_{name}")
                    found[name] = str(one.module)
    return found


def lazy_homes(face: types.ModuleType) -> HOMES:
    """Return the lazy exports of a package at run time."""
    load = vars(face).get("__getattr__")
    return {} if load is None else dict(inspect.getclosurevars(load).nonlocals["homes"])


def in_all(tree: ast.Module) -> list[str]:
    """Return the content of `__all__`, which every face has."""
    for node in tree.body:
        target = node.targets[0] if isinstance(node, ast.Assign) else None
        target = node.target if isinstance(node, ast.AnnAssign) else target
        if isinstance(target, ast.Name) and target.id == "__all__":
            assert isinstance(node, ast.Assign | ast.AnnAssign)
            assert node.value is not None
            return list(ast.literal_eval(node.value))
    raise AssertionError("no __all__")


@pytest.mark.parametrize("package", FACES)
def test_lists_agree_and_every_name_loads(package: str) -> None:
    tree = ast.parse(FACES[package].read_text(encoding="utf-8"))
    names = in_all(tree)
    assert len(set(names)) == len(names)
    homes = for_type_checkers(package, tree)
    module = import_module(package)
    assert lazy_homes(module) == homes
    if package == "ocmm_core":
        assert not homes
    else:
        assert set(names) == set(homes)
    for name in names:
        assert getattr(module, name) is not None


@pytest.mark.parametrize("package", FACES)
def test_lists_are_as_generated(package: str) -> None:
    text = FACES[package].read_text(encoding="utf-8")
    assert text == written(text), "run: python -m benchmarks.house_faces"


def test_generator_adds_names_to_both_lists_in_order() -> None:
    head = '"""A package."""\n\nfrom ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports\n\n'
    head += "if TYPE_CHECKING:\n"
    tail = "else:\n    __getattr__ = lazy_exports(__name__)\n\n"
    x, y, z, last = (f"function_with_a_long_name_{number}" for number in range(4))
    added = "    from pack._b import Ant, one, ZERO\n    from pack import _a as a\n"
    added += f"    from pack._c import {last}, {x}, {y}, {z}\n"
    face = written(f"{head}{added}{tail}__all__ = []\n")
    assert face == (
        f"{head}"
        "    from pack import _a as a\n"
        "    from pack._b import ZERO, Ant, one\n"
        f"    from pack._c import (\n        {x}, {y}, {z},\n        {last},\n    )  # fmt: skip\n"
        f"{tail}"
        "__all__ = [\n"
        f'    "ZERO", "Ant", "a", "{x}", "{y}",\n'
        f'    "{z}", "{last}", "one",\n'
        "]  # fmt: skip\n"
    )
    assert written(face) == face


@pytest.mark.parametrize("package", FACES)
def test_docstring_names_inputs_outputs_and_existing_files(package: str) -> None:
    text = ast.get_docstring(ast.parse(FACES[package].read_text(encoding="utf-8"))) or ""
    first, _, rest = text.partition("\n\n")
    assert first.endswith(".")
    assert "\n" not in first
    assert re.search(r"\bIn: ", rest)
    assert re.search(r"\bOut: ", rest)
    assert 5 <= len(text.splitlines()) <= 15
    folder = FACES[package].parent
    for name in re.findall(r"`(_[a-z0-9][a-z0-9_]*)`", text):
        assert (folder / f"{name}.py").is_file(), f"{package} has no file {name}.py"


@pytest.mark.parametrize("package", sorted(FACES))
def test_package_rejects_unknown_names(package: str) -> None:
    face = import_module(package)
    with pytest.raises(
        AttributeError, match=rf"module '{re.escape(package)}' has no attribute 'Rigg'"
    ):
        face.Rigg  # noqa: B018 - access alone is tested
    with pytest.raises(ImportError, match="cannot import name 'Rigg'"):
        exec(f"from {package} import Rigg", {})  # noqa: S102 - no checker should see it


def test_modules_load_on_first_use_and_are_cached(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "package_of_a_test").mkdir()
    (tmp_path / "package_of_a_test" / "__init__.py").write_text(
        "from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports\n"
        "if TYPE_CHECKING:\n"
        "    from package_of_a_test import _two as two\n"
        "    from package_of_a_test._broken import lost\n"
        "    from package_of_a_test._one import ONE, one\n"
        "else:\n"
        "    __getattr__ = lazy_exports(__name__)\n"
    )
    (tmp_path / "package_of_a_test" / "_one.py").write_text("ONE = 1\ndef one():\n    return ONE\n")
    (tmp_path / "package_of_a_test" / "_two.py").write_text("TWO = 2\n")
    (tmp_path / "package_of_a_test" / "_broken.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    try:
        package = import_module("package_of_a_test")
        assert "package_of_a_test._one" not in sys.modules
        assert package.ONE == 1
        assert "package_of_a_test._two" not in sys.modules
        # A function may have the name of its file; a file renamed by `as` is given out itself.
        assert package.one() == 1
        assert isinstance(package.two, types.ModuleType)
        assert package.two.TWO == 2
        assert {"ONE", "one", "two"} <= set(vars(package))
        with pytest.raises(AttributeError, match="has no attribute 'TWO'"):
            _ = package.TWO
        with pytest.raises(AttributeError, match="lost"):
            _ = package.lost
    finally:
        for name in [name for name in sys.modules if name.startswith("package_of_a_test")]:
            del sys.modules[name]


def test_call_outside_a_package_rejects_every_name() -> None:
    with pytest.raises(AttributeError, match="module 'ocmm_core' has no attribute 'rig'"):
        lazy_exports("ocmm_core")("rig")


@pytest.mark.parametrize(
    ("path", "line", "entered"),
    [
        # The tested package, and public APIs, are open.
        ("tests/core/camera/test_a.py", "from ocmm_core.camera._rig import Rig", ""),
        ("tests/core/camera/test_a.py", "from ocmm_core.camera import Rig, _rig", ""),
        ("tests/gui/test_a.py", "from ocmm_gui.kit._messages import mm", ""),
        ("tests/core/fieldbus/test_a.py", "from ocmm_core.fieldbus.wire._port import Port", ""),
        ("benchmarks/a.py", "from ocmm_core.camera import Rig", ""),
        ("benchmarks/a.py", "from ocmm_core import __version__", ""),
        # Other packages are imported by their public API.
        ("tests/core/camera/test_a.py", "from ocmm_core.tracking._pose import solve",
         "ocmm_core.tracking"),
        ("tests/core/camera/test_a.py", "from ocmm_core.tracking import _pose",
         "ocmm_core.tracking"),
        ("tests/core/camera/test_a.py", "import ocmm_core.tracking._pose", "ocmm_core.tracking"),
        ("tests/core/test_a.py", "from ocmm_core.camera._rig import Rig", "ocmm_core.camera"),
        ("tests/system/test_a.py", "from ocmm_core.camera._rig import Rig", "ocmm_core.camera"),
        ("tests/gui/test_a.py", "from ocmm_core.camera._rig import Rig", "ocmm_core.camera"),
        ("benchmarks/a.py", "def f():\n    from ocmm_core.camera._rig import Rig",
         "ocmm_core.camera"),
        ("docs/images/a.py", "from ocmm_gui.wizards.pages._shown import Gate",
         "ocmm_gui.wizards.pages"),
        ("installer/a.py", "from ocmm_core.camera._rig import Rig", "ocmm_core.camera"),
    ],
)  # fmt: skip
def test_inner_imports_from_outside_are_found(
    tmp_path: Path, path: str, line: str, entered: str
) -> None:
    file = tmp_path / path
    file.parent.mkdir(parents=True)
    file.write_text(f"{line}\n")
    found = list(inner_imports_from_outside(tmp_path))
    assert [package_of(one.imported) for one in found] == ([entered] if entered else [])
    for one in found:
        assert one.importer == path
        assert str(one).endswith(f"import from {entered}")


def test_inner_imports_inside_the_product_are_found() -> None:
    graph = ImportGraph()
    for name in (
        "ocmm_core", "ocmm_core.camera", "ocmm_core.camera._rig", "ocmm_core.camera._model",
        "ocmm_core.tracking", "ocmm_core.tracking._pose", "ocmm_core.tracking.kernels",
        "ocmm_core.tracking.kernels._kernel", "ocmm_core.errors",
    ):  # fmt: skip
        graph.add_module(name)
    for importer, imported in (
        ("ocmm_core.camera", "ocmm_core.camera._rig"),
        ("ocmm_core.camera._rig", "ocmm_core.camera._model"),
        ("ocmm_core.camera._rig", "ocmm_core.errors"),
        ("ocmm_core.tracking._pose", "ocmm_core.camera"),
        ("ocmm_core.tracking._pose", "ocmm_core.tracking.kernels"),
    ):
        graph.add_import(importer=importer, imported=imported)
    assert not list(inner_imports_inside(graph))
    # Wrong for a sibling package, a parent and a child alike.
    wrong = {
        ("ocmm_core.tracking._pose", "ocmm_core.camera._rig"),
        ("ocmm_core.tracking", "ocmm_core.camera._model"),
        ("ocmm_core.tracking._pose", "ocmm_core.tracking.kernels._kernel"),
        ("ocmm_core.tracking.kernels._kernel", "ocmm_core.tracking._pose"),
        ("ocmm_core.errors", "ocmm_core.camera._rig"),
    }
    for importer, imported in wrong:
        graph.add_import(importer=importer, imported=imported, line_number=7, line_contents="")
    found = list(inner_imports_inside(graph))
    assert {(one.importer, one.imported) for one in found} == wrong
    assert {one.line for one in found} == {7}

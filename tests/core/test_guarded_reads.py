"""Files of users and stations are read through the guard of `side_files` only."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from tests.sources import parsed_with

_READERS = ("read_bytes", "read_text", "fromfile", "loadtxt", "genfromtxt", "memmap")
_GUARDS = ("open_guarded", "descriptor")

# Files that read without the guard: why they may.
EXCEPTIONS = {
    "ocmm_core/acquisition/bus_process/_rights.py": "/proc",
    "ocmm_core/acquisition/recording/_recorder.py": "a file that it has just made",
    "ocmm_shop/archive/outbox/_outbox_file.py": "the identity of the computer in /etc",
    "ocmm_core/cpu_features.py": "sources of this program",
    "ocmm_shop/cluster/_worker.py": "sources of this program",
    "ocmm_core/build.py": "the line of its own build",
    "ocmm_core/export/_registry.py": "temporary files that it has just made",
    "ocmm_core/fieldbus/wire/_interface.py": "/proc",
    "ocmm_core/host/_posix.py": "/proc",
    "ocmm_sim/bus/_named_rig.py": "/proc",
    "ocmm_genicam/_link.py": "/proc",
    "ocmm_sim/genicam/_device.py": "/proc",
    "ocmm_core/manual/_manual.py": "the manual of this program",
    "ocmm_gui/help/_what_to_do.py": "texts of this program",
}
# Files that list folders without `find_files` or `files_of_folder`: why a folder may be left out.
LISTS = {
    "ocmm_core/acceptance/_procedure.py": "procedures of this program",
    "ocmm_core/acquisition/frames/_ring.py": "rings that were left over",
    "ocmm_shop/archive/outbox/_follow.py": "notes of running programs",
    "ocmm_shop/archive/outbox/_outbox.py": "copies that are not needed",
    "ocmm_shop/cluster/_worker.py": "sources of this program",
    "ocmm_core/composition/_feeds.py": "folders that this program writes to",
    "ocmm_sim/sources/_feed_makers.py": "copies that are not needed",
    "ocmm_core/doctor/_computer.py": "errors are results of a check",
    "ocmm_core/documents.py": "the functions themselves",
    "ocmm_core/export/audits/_audit.py": "an unreadable folder is audited as a file",
    "ocmm_core/failure.py": "old logs",
    "ocmm_core/fieldbus/described/_device_check.py": "documents of this program",
    "ocmm_core/fieldbus/wire/_interface.py": "/sys and /proc",
    "ocmm_core/fieldbus/wire/_sockets.py": "/proc",
    "ocmm_core/host/_posix.py": "/proc",
    "ocmm_core/inspection/finished/_batch.py": "a list of offers",
    "ocmm_core/inspection/plan/_file_beside.py": "copies, and models next to a reference",
    "ocmm_core/inspection/plan/_file.py": "a list of offers",
    "ocmm_core/cleanup.py": "files that were left over",
    "ocmm_core/manual/_manual.py": "the manual of this program",
    "ocmm_core/seals/_anchor.py": "the memory; each history is read by its own name",
    "ocmm_core/seals/_memory.py": "as above",
    "ocmm_core/support/_parts.py": "a bundle of what can be read",
    "ocmm_core/features/measured/_verify.py": "files next to one that was found",
    "ocmm_gui/home/_file_browser.py": "errors are shown",
    "ocmm_planner/_plan.py": "catalogues of this program",
}
_LISTERS = ("glob", "rglob", "iterdir", "walk", "scandir", "listdir")
_CAMPAIGN = "ocmm_bench/campaign/"
"""Trials make and read files in their own folders."""


def _reads(tree: ast.AST) -> Iterator[ast.Call]:
    """Yield the calls that read a file by its path."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        name = node.func
        method = isinstance(name, ast.Attribute)
        word = name.attr if isinstance(name, ast.Attribute) else getattr(name, "id", "")
        read = isinstance(name, ast.Attribute) and word in _READERS and not _is_guard(name)
        if read or (word == "open" and _is_reading(node, method=method)):
            yield node


def _is_guard(name: ast.Attribute) -> bool:
    """Whether a function is one of `ocmm_core.documents`, which guard."""
    return isinstance(name.value, ast.Name) and name.value.id == "documents"


def _is_reading(node: ast.Call, *, method: bool) -> bool:
    modes = [*node.args[0 if method else 1 :][:1], *(k.value for k in node.keywords)]
    words = [one.value for one in modes if isinstance(one, ast.Constant)]
    if method:
        # Other things than paths are opened without a mode.
        return any(isinstance(one, str) and one.startswith("r") for one in words)
    guarded = any(word in ast.unparse(node.args[0]) for word in _GUARDS)
    return not guarded and not any(isinstance(one, str) and one[:1] in "wxa" for one in words)


def test_reads_files_through_the_guard_only() -> None:
    found = {}
    for name, tree in parsed_with(*(f"{name}(" for name in (*_READERS, "open"))):
        if name.startswith(_CAMPAIGN):
            continue
        lines = [node.lineno for node in _reads(tree)]
        if lines:
            found[name] = lines
    assert {name: at for name, at in found.items() if name not in EXCEPTIONS} == {}
    assert set(EXCEPTIONS) <= set(found)


def test_lists_folders_without_hiding_unreadable_ones() -> None:
    found = set()
    for name, tree in parsed_with(*(f"{name}(" for name in _LISTERS)):
        calls = [node for node in ast.walk(tree) if _is_list(node)]
        if calls and not name.startswith(_CAMPAIGN):
            found.add(name)
    assert found == set(LISTS)


def _is_list(node: ast.AST) -> bool:
    """Whether a call lists a folder of files."""
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
        return False
    return node.func.attr in _LISTERS and ast.unparse(node.func.value) != "ast"


def test_finds_reads() -> None:
    text = (
        "path.read_bytes()\nPath(a).read_text('utf-8')\nopen(a)\nwith a.open('rb') as b: pass\n"
        "np.fromfile(a)\nopen(open_guarded(a), 'rb')\nsource.open()\na.open('wb')\nread_text(a)\n"
        "a.read_text(encoding='ascii')\n"
    )
    assert sorted(node.lineno for node in _reads(ast.parse(text))) == [1, 2, 3, 4, 5, 10]

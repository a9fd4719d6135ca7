"""The sources contain nothing that turns data into code, or exceeds its stated reach."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.house_tree import ROOTS

ROOT = Path(__file__).resolve().parents[2]
_SOURCES = sorted(
    path.relative_to(ROOT)
    for folder in (*ROOTS, "installer")
    for path in (ROOT / folder).rglob("*.py")
)
_MODULES = {
    "pickle": "makes objects of bytes",
    "cPickle": "makes objects of bytes",
    "_pickle": "makes objects of bytes",
    "dill": "makes objects of bytes",
    "cloudpickle": "makes objects of bytes",
    "joblib": "loads pickles",
    "shelve": "holds pickles",
    "marshal": "makes code of bytes",
    "yaml": "makes objects of text, with `load`",
    "code": "runs text as code",
    "codeop": "makes code of text",
    "xml.sax": "expands entities",
    "xml.dom": "expands entities",
    "multiprocessing.managers": "takes pickles from a socket",
    "telnetlib": "sends in clear text",
    "ftplib": "sends in clear text",
}
_NAMES = {
    "eval": "runs text as code",
    "exec": "runs text as code",
    "compile": "makes code of text",
    "__import__": "runs a module that text names",
}
# By the end of the call, for any name of the module.
_ENDS = {
    "os.system": "runs a shell",
    "os.popen": "runs a shell",
    "subprocess.getoutput": "runs a shell",
    "subprocess.getstatusoutput": "runs a shell",
    "asyncio.create_subprocess_shell": "runs a shell",
    "tempfile.mktemp": "another program can take the name",
    "connection.Listener": "takes pickles from a socket",
    "connection.Client": "takes pickles from a socket",
    "multiprocessing.Manager": "takes pickles from a socket",
    "ElementTree.parse": "expands entities",
    "ElementTree.fromstring": "expands entities",
    "ElementTree.iterparse": "expands entities",
    "ElementTree.XML": "expands entities",
    "ElementTree.XMLParser": "expands entities",
}
_FLAGS = {
    "allow_pickle": "makes objects of bytes",
    "shell": "runs a shell",
    "huge_tree": "a small file takes all memory",
    "resolve_entities": "a file reads other files",
    "load_dtd": "a file reads other files",
}
_SAFE_PARSER = {"resolve_entities": False, "no_network": True, "huge_tree": False}
_LXML_READERS = {"parse", "fromstring", "iterparse", "XML", "HTML", "XMLID", "fromstringlist"}

# (file, what): why it may.
EXCEPTIONS: dict[tuple[str, str], str] = {
    ("ocmm_cli/terminal/_svg.py", "xml.sax.saxutils"): "escapes what is written, reads nothing",
    (
        "installer/bundle/pages.py",
        "shell",
    ): "names the shell whose words are completed, starts none",
}


def found_in(text: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the name of each dangerous call in a source text."""
    tree = ast.parse(text)
    reads_with_lxml = "lxml" in text
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, one.name) for one in node.names if _is_banned(one.name))
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [f"{node.module}.{one.name}" for one in node.names]
            if _is_banned(node.module):
                yield node.lineno, node.module
            else:
                # `from os import system` and `from xml import sax` are the same by other words.
                yield from (
                    (node.lineno, name)
                    for name in names
                    if _is_banned(name) or any(name.endswith(end) for end in _ENDS)
                )
        elif isinstance(node, ast.Call):
            yield from _found_in_call(node, reads_with_lxml)


def _is_banned(module: str) -> bool:
    return any(module == one or module.startswith(f"{one}.") for one in _MODULES)


def _called(function: ast.expr) -> str:
    """Return the called name, with dots; expressions are replaced by brackets."""
    parts = []
    while isinstance(function, ast.Attribute):
        parts.append(function.attr)
        function = function.value
    parts.append(function.id if isinstance(function, ast.Name) else "()")
    return ".".join(reversed(parts))


def _found_in_call(node: ast.Call, reads_with_lxml: bool) -> Iterator[tuple[int, str]]:
    name = _called(node.func)
    keywords = {one.arg: one.value for one in node.keywords}
    if name in _NAMES:
        yield node.lineno, name
    for end in _ENDS:
        if name == end or name.endswith(f".{end}"):
            yield node.lineno, end
    for flag in _FLAGS.keys() & keywords.keys():
        value = keywords[flag]
        if not (isinstance(value, ast.Constant) and value.value is False):
            yield node.lineno, flag
    if not reads_with_lxml:
        return
    last = name.rpartition(".")[2]
    if last in ("XMLParser", "XMLPullParser", "iterparse", "HTMLParser"):
        given = {arg: value.value for arg, value in keywords.items()
                 if isinstance(value, ast.Constant)}  # fmt: skip
        if not _SAFE_PARSER.items() <= given.items():
            yield node.lineno, last
    elif (
        name.startswith("etree.")
        and last in _LXML_READERS
        # Without a parser of ours it reads entities.
        and len(node.args) < 2
        and "parser" not in keywords
    ):
        yield node.lineno, name


@pytest.mark.parametrize("path", _SOURCES, ids=str)
def test_nothing_of_it_is_in_the_sources(path: Path) -> None:
    found = [
        f"{path}:{line}: {what}"
        for line, what in found_in((ROOT / path).read_text(encoding="utf-8"))
        if (str(path), what) not in EXCEPTIONS
    ]
    assert not found


def test_every_exception_is_needed() -> None:
    for path, what in EXCEPTIONS:
        text = (ROOT / path).read_text(encoding="utf-8")
        assert what in {name for _, name in found_in(text)}, path


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("import pickle", "pickle"),
        ("from pickle import loads", "pickle"),
        ("import xml.dom.minidom", "xml.dom.minidom"),
        ("from xml import sax", "xml.sax"),
        ("from os import system", "os.system"),
        ("from multiprocessing.connection import Listener", "multiprocessing.connection.Listener"),
        ("eval(text)", "eval"),
        ("exec(text)", "exec"),
        ("compile(text, '', 'exec')", "compile"),
        ("np.load(path, allow_pickle=True)", "allow_pickle"),
        ("np.load(path, allow_pickle=flag)", "allow_pickle"),
        ("subprocess.run(text, shell=True)", "shell"),
        ("os.system(text)", "os.system"),
        ("loaded().os.system(text)", "os.system"),
        ("tempfile.mktemp()", "tempfile.mktemp"),
        ("ElementTree.fromstring(text)", "ElementTree.fromstring"),
        ("from lxml import etree; etree.fromstring(text)", "etree.fromstring"),
        ("from lxml import etree; etree.XMLParser(no_network=True)", "XMLParser"),
        ("from lxml import etree; etree.XMLParser(huge_tree=True)", "huge_tree"),
    ],
)
def test_it_would_be_found(text: str, what: str) -> None:
    assert what in {name for _, name in found_in(text)}


@pytest.mark.parametrize(
    "text",
    [
        "app.exec()",
        "re.compile(text)",
        "np.load(path)",
        "np.load(path, allow_pickle=False)",
        "subprocess.run(['ls'], shell=False)",
        "from lxml import etree\n"
        "p = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=False)\n"
        "etree.fromstring(text, p)",
        "ElementTree.tostring(root)",
        "from multiprocessing.connection import Connection",
    ],
)
def test_what_is_harmless_is_let_through(text: str) -> None:
    assert not list(found_in(text))

"""Every option, setting and environment variable is described once, in the table."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import pytest
import typer

from ocmm_cli._app import _BUILT, app
from ocmm_cli.options import OPTIONS, describe, described, option_of, read_typed_numbers
from ocmm_core.composition import Errand, StationRequest, request_of_settings
from ocmm_core.documents import resource
from ocmm_core.options import (
    DEFAULT_OPERATOR,
    DEFAULT_SERIAL,
    OF_SERVER,
    OF_SETTINGS,
    VARIABLES,
    WINDOW,
)
from ocmm_core.settings import SETTINGS, Kind, SettingsStore
from ocmm_gui._start import given, parser
from tests.sources import parsed_with

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = sorted(path for path in ROOT.glob("ocmm_*") if path.is_dir())
SHIPPED = [*PACKAGES, ROOT / "installer"]
_OF_TYPER = {"help", "install_completion", "show_completion"}
_SET_IN = re.compile(r"\bOCMM_[A-Z_]+")
_READ = {"get", "setdefault", "pop"}
PAGES = ("docs/developer/testing.md", "docs/quality/exports.md")
"""Where variables of the tests are described."""


def commands(path: str, command: Any) -> Iterator[tuple[str, Any]]:
    yield path, command
    for below, one in getattr(command, "commands", {}).items():
        yield from commands(f"{path} {below}", one)


PARAMETERS = [
    (path, one)
    for top in _BUILT
    for path, command in commands(top, _BUILT[top])
    for one in command.params
    if one.name not in _OF_TYPER
] + [("ocmm", one) for one in typer.main.get_command(app).params if one.name not in _OF_TYPER]


def test_each_parameter_of_each_command_is_that_of_its_entry() -> None:
    assert len(PARAMETERS) > 700
    for path, one in PARAMETERS:
        entry = option_of(path, one.name)
        assert entry is not None, f"{path} {one.name}: add it to ocmm_cli/options"
        assert (one.help or "") == entry.text, (path, one.name)
        if not entry.is_argument:
            flags = " ".join(entry.typed).replace("/", " ").split()
            assert [*one.opts, *one.secondary_opts] == flags, (path, one.name)


def test_each_entry_is_used() -> None:
    """An entry for fewer commands is that of one of them; an entry of all may be the window's."""
    wanted = {(path, one.name) for path, one in PARAMETERS}
    windows = {one.name for one in WINDOW}
    for place, name in OPTIONS:
        users = [path for path, own in wanted if own == name and f"{path} ".startswith(place)]
        assert users or (not place and name in windows), f"{place} {name} is of no command"


def test_a_command_with_an_option_out_of_the_table_is_not_built() -> None:
    def command(*, colour: str) -> None:
        del colour

    with pytest.raises(KeyError, match="measure colour"):
        described(command, "measure")


def test_a_command_of_another_maker_describes_its_own_options(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A name of the table does not change it: neither text nor default nor range."""
    added = typer.Typer()

    def command(
        seed: Annotated[int, typer.Option(help="Of my dice.")] = -1,
        name: Annotated[str, typer.Argument(help="Of my camera.")] = "mine",
    ) -> None:
        typer.echo(f"{seed} {name}")

    added.command(name="dice")(command)
    describe(added)
    built = typer.main.get_command(added)
    read_typed_numbers(built, "dice")
    texts = {one.name: getattr(one, "help", "") for one in built.params}
    assert texts["seed"] == "Of my dice."
    with pytest.raises(SystemExit) as ended:
        built.main(["--seed", "-7"], prog_name="dice")
    assert not ended.value.code
    assert capsys.readouterr().out == "-7 mine\n"


def test_only_the_table_makes_options() -> None:
    """Options of typer state how a value is read; arguments of the window come in one loop."""
    for path, tree in parsed_with("typer.Option(", "typer.Argument("):
        calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
        for call in calls:
            name = ast.unparse(call.func)
            if name in ("typer.Option", "typer.Argument") and "/options/" not in path:
                stated = {one.arg for one in call.keywords}
                assert not call.args, f"{path}: {ast.unparse(call)}"
                assert not stated & {"help", "envvar"}, f"{path}: {ast.unparse(call)}"
    source = (ROOT / "ocmm_gui" / "_start.py").read_text(encoding="utf-8")
    assert source.count("add_argument(") == 1


def test_a_setting_and_its_option_have_one_default_and_one_range(
    capsys: pytest.CaptureFixture[str],
) -> None:
    by_key = {spec.key: spec for spec in SETTINGS}
    for option in (*OF_SETTINGS, *OF_SERVER):
        spec = by_key[option.setting]
        assert option.default == spec.default
        # Port 0 is any free port, which a setting cannot mean.
        assert option.number == spec.number or option.name in ("stream", "port")
        assert (spec.kind in (Kind.NUMBER, Kind.WHOLE)) == bool(option.number)
    assert given(parser().parse_args([])) == {}
    typed = ["--check-after", "4", "--silent", "--rig", "/r.toml", "--theme", "light"]
    assert given(parser().parse_args(typed)) == {
        "instrument.check_after_h": 4.0, "window.sounds": False,
        "instrument.rig": Path("/r.toml"), "window.theme": "light",
    }  # fmt: skip
    for wrong in ("0", "169", "nan"):
        with pytest.raises(SystemExit):
            parser().parse_args(["--check-after", wrong])
        assert "0.1 to 168 h" in capsys.readouterr().err


def test_operator_and_serial_have_one_default() -> None:
    plan = resource("plans", "quick.toml")
    store = SettingsStore.of_this_user()
    of_window = request_of_settings(store.load().settings, Errand(plan))
    of_script = StationRequest(plan=plan, out=Path())
    for request in (of_window, of_script):
        assert (request.operator, request.serial) == (DEFAULT_OPERATOR, DEFAULT_SERIAL)
    for name, default in (("operator", DEFAULT_OPERATOR), ("serial", DEFAULT_SERIAL)):
        entry = option_of("measure", name)
        assert entry is not None
        assert entry.default == default
    assert parser().parse_args([]).serial == DEFAULT_SERIAL
    names = {one.default for path, one in PARAMETERS if one.name == "who" and one.default}
    assert names == {DEFAULT_OPERATOR}


def variables_read(tree: ast.Module) -> Iterator[str]:
    """Yield the names of variables that a source reads of an environment."""
    constants = {
        target.id: node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Subscript):
            place, key = node.value, node.slice
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") in _READ and node.args:
            place, key = getattr(node.func, "value"), node.args[0]  # noqa: B009 - an attribute
        else:
            continue
        if not ast.unparse(place).endswith(("environ", "environment")):
            continue
        name = constants.get(getattr(key, "id", ""), getattr(key, "value", None))
        if isinstance(name, str):
            yield name


def test_each_environment_variable_is_in_the_table() -> None:
    described_names = {name for one in VARIABLES for name in one.name.split()}
    read: set[str] = set()
    for file, tree in parsed_with("environ", "environment"):
        found = set(variables_read(tree))
        # The bench sets variables of the processes that it tests.
        if not file.startswith("ocmm_bench/"):
            read |= found
    assert "OCMM_LANGUAGE" in read
    assert not read - described_names, "add it to VARIABLES of ocmm_core/options.py"
    ours: set[str] = set()
    for place in [*SHIPPED, ROOT / "tests", ROOT / "benchmarks", ROOT / "run"]:
        for path in [place] if place.is_file() else place.rglob("*"):
            if (
                path.is_file()
                and path.suffix in (".py", ".sh", ".service", "")
                and path != Path(__file__)
            ):
                ours |= set(_SET_IN.findall(path.read_text(encoding="utf-8", errors="replace")))
    told = " ".join((ROOT / page).read_text(encoding="utf-8") for page in PAGES)
    for name in ours - described_names:
        assert name in told, f"describe {name} in {PAGES[0]}"

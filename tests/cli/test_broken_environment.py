"""Commands in broken environments: a sentence and a code of the table, no abort, no traceback.

Display, libraries and locale are in `test_stale_display`; sudo, apt, dpkg, python and the disk of
the set-up in `tests/shipped/test_run_in_trouble.py`. `test_thirty_kinds_are_tried` counts them.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from ocmm_core.documents import resource
from tests.cli.test_stale_display import _LIBRARIES, _STALE
from tests.host import HANG_S, on_linux_only
from tests.shipped.test_run_in_trouble import TROUBLES

pytestmark = [on_linux_only, pytest.mark.slow]

# Nobody writes there, root included.
NOWHERE = "/proc/nowhere"
CHECK, CHANGE, KEY = "settings check", "settings set window.theme dark", "key show"
RELEASE = "plan release quick.toml --by Q"
FULL = "ulimit -f 0; trap '' XFSZ; "


@dataclass(frozen=True, slots=True)
class Broken:
    kind: str
    words: str
    told: str = ""
    """Part of the message; empty if the command must work."""
    environment: tuple[tuple[str, str | None], ...] = ()
    before: str = ""
    """Run by the shell before the command."""
    after: str = ""


CASES = [
    Broken("home: unset", CHECK, environment=(("HOME", None),)),
    Broken("home: empty", CHECK, environment=(("HOME", ""),)),
    Broken("home: missing", CHANGE, "cannot be written", (("HOME", NOWHERE),)),
    Broken("home: a file", CHANGE, "cannot be written", (("HOME", "{here}/a_file"),)),
    Broken("home: missing, key", KEY, "key", (("HOME", NOWHERE),)),
    Broken("home: settings", CHANGE, "cannot be written", (("XDG_CONFIG_HOME", NOWHERE),)),
    Broken("home: data", KEY, "key", (("XDG_DATA_HOME", NOWHERE),)),
    Broken("home: state", RELEASE, "cannot remember it", (("XDG_STATE_HOME", NOWHERE),)),
    Broken("rights: folder of the job", "measure --plan quick.toml --out /proc/out", "/proc/out"),
    Broken("rights: out is a file", "measure --plan quick.toml --out a_file", "a_file"),
    Broken("rights: plan", "plan check /proc/kmem", "/proc/kmem"),
    Broken("rights: bus", "measure --plan quick.toml --source ethercat:none0 --out o", "none0"),
    Broken("disk: full, settings", CHANGE, "cannot be written", before=FULL),
    Broken("disk: full, release", RELEASE, "cannot be stored", before=FULL),
    Broken("disk: full, job", "measure --plan quick.toml --out o", "no room", before=FULL),
    Broken("disk: full, output", "settings show", "could not be written", after=">/dev/full"),
    Broken("disk: no TMPDIR", RELEASE, environment=(("TMPDIR", NOWHERE),)),
    Broken("disk: few descriptors", CHECK, before="ulimit -n 12; "),
    Broken("locale: unknown", CHECK, environment=(("LC_ALL", "xx_YY.UTF-8"),)),
    Broken("locale: C", "--language de settings show", environment=(("LC_ALL", "C"),)),
    Broken("locale: ASCII", "--language de settings show",
           environment=(("PYTHONIOENCODING", "ascii"),)),
    Broken("locale: no time zone", CHECK, environment=(("TZ", "No/Where"),)),
    Broken("terminal: unknown", "settings show", environment=(("TERM", "nonsense"),)),
    Broken("terminal: COLUMNS", "settings show", environment=(("COLUMNS", "abc"),)),
    Broken("terminal: 1 column", "settings show", environment=(("COLUMNS", "1"),)),
    Broken("terminal: no input", CHECK, after="<&-"),
    Broken("terminal: no output", CHECK, after=">&-"),
    Broken("terminal: no error", CHECK, after="2>&-"),
    Broken("python: threads", CHECK, environment=(("OPENBLAS_NUM_THREADS", "abc"),)),
    Broken("python: optimized", CHECK, environment=(("PYTHONOPTIMIZE", "2"),)),
    Broken("python: warnings", "settings show", environment=(("PYTHONWARNINGS", "error"),)),
    Broken("network: proxy", "archive verify --archive postgresql://n@127.0.0.1:1/none", "127",
           (("http_proxy", "nonsense://"), ("ALL_PROXY", "nonsense://"))),
    Broken("network: archive", "archive verify --archive postgresql://n@127.0.0.1:1/none", "127"),
    Broken("network: scheduler", "settings set archive.place postgresql://n@/", "archive.place"),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.kind)
def test_ends_with_a_sentence_and_a_code_of_the_table(case: Broken, tmp_path: Path) -> None:
    (tmp_path / "a_file").touch()
    (tmp_path / "quick.toml").write_bytes(resource("plans", "quick.toml").read_bytes())
    environment = {**os.environ, "HOME": str(tmp_path / "home")}
    (tmp_path / "home").mkdir()
    for name in ("XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME"):
        environment.pop(name, None)
    for name, value in case.environment:
        environment.pop(name, None)
        if value is not None:
            environment[name] = value.format(here=tmp_path)
    program = f"exec {shlex.quote(sys.executable)} -m ocmm_cli"
    command = f"{case.before}{program} {case.words} {case.after}"
    done = subprocess.run(
        ["sh", "-c", command], cwd=tmp_path, env=environment, capture_output=True, timeout=HANG_S,
        check=False, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    told = done.stderr.decode("utf-8", "replace")
    assert done.returncode == (2 if case.told else 0), told
    assert case.told in " ".join(told.split())
    assert "Traceback" not in told
    assert (told != "") is (case.told != "")


def test_thirty_kinds_are_tried() -> None:
    kinds = [case.kind for case in CASES] + [f"display: {one}" for one in _STALE]
    kinds += [f"libraries: {one}" for one in _LIBRARIES]
    kinds += [f"set-up: {one}" for one in TROUBLES]
    assert len(set(kinds)) == len(kinds) >= 30
    assert {kind.split(":")[0] for kind in kinds} >= {
        "display", "libraries", "locale", "disk", "home", "rights", "python", "network", "set-up",
    }  # fmt: skip

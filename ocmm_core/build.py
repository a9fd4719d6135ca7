"""Identity of this build: version, commit, and whether its sources were changed since.

``_build.txt`` next to this file names the commit: `git archive` and `setup.py` fill it. A checkout
queries git instead.
"""

from __future__ import annotations

import functools
import shutil
import subprocess
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from ocmm_core import __version__

FORMAT = " ".join(("%H", "%cI", "%(describe:tags=true,match=v*)"))
"""Of `git log`: commit, its date, and the last release with the distance to it."""
_FILE = Path(__file__).with_name("_build.txt")
_ANSWER_S = 5.0


@dataclass(frozen=True, slots=True)
class BuildIdentity:
    """The commit that a build is made of; empty texts if unknown."""

    commit: str = ""
    date: str = ""
    """ISO 8601, of the commit."""
    tag: str = ""
    """Last release and distance, as `git describe` prints them."""
    changed: bool = False
    """Whether sources differ from the commit."""

    @property
    def version(self) -> str:
        """Return the version, with the commit unless it is that of the release (PEP 440)."""
        if not self.commit or (self.tag == f"v{__version__}" and not self.changed):
            return __version__
        local = f"g{self.commit[:10]}.{self.date[:10].replace('-', '')}"
        return f"{__version__}+{local}{'.changed' if self.changed else ''}"

    def line(self) -> str:
        """Return the line of ``_build.txt``."""
        words = (self.commit, self.date, self.tag or "-", "changed" if self.changed else "")
        return " ".join(words).strip()


@functools.cache
def this_build() -> BuildIdentity:
    """Return the identity of the running program, from its file or from git."""
    words: list[str] = []
    with suppress(OSError):
        words = _FILE.read_text("utf-8").split()
    if not words or words[0].startswith("$"):
        words = _of_git(Path(__file__).resolve().parents[1])
    if len(words) < 2:
        return BuildIdentity()
    changed = "changed" in words[2:]
    tag = next((word for word in words[2:] if word.startswith("v")), "")
    return BuildIdentity(words[0], words[1], tag, changed)


def build_version() -> str:
    """Return the version of this build, e.g. ``0.2.0+g1a2b3c4d5e.20261128``."""
    return this_build().version


def _of_git(folder: Path) -> list[str]:
    git = shutil.which("git")
    if git is None or not (folder / ".git").exists():
        return []
    base = [git, "--no-optional-locks", "-C", str(folder)]

    def answer(*words: str) -> str:
        done = subprocess.run(  # noqa: S603 - git, found in PATH
            [*base, *words], capture_output=True, text=True, timeout=_ANSWER_S, check=True,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
        return done.stdout.strip()

    try:
        named = answer("log", "-1", f"--format={FORMAT}")
        status = answer("status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return []
    return [*named.split(), *(["changed"] if status else [])]

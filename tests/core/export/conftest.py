from __future__ import annotations

import contextlib
import locale
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.host import not_run

_MADE = "ocmm_comma.UTF-8"


@pytest.fixture(scope="session")
def made_locales(tmp_path_factory: pytest.TempPathFactory) -> Path | None:
    """Return the folder of a locale with a decimal comma, made here; None if that is impossible."""
    if not shutil.which("localedef"):
        return None
    folder = tmp_path_factory.mktemp("locales")
    command = ["localedef", "--no-archive", "-i", "de_DE", "-f", "UTF-8", str(folder / _MADE)]
    done = subprocess.run(command, capture_output=True, check=False)
    return folder if done.returncode == 0 else None


@pytest.fixture
def comma_locale(made_locales: Path | None) -> Iterator[None]:
    """Run the test in a locale with a decimal comma, made for it if none is installed."""
    before = locale.setlocale(locale.LC_ALL)
    names = ["de_DE.UTF-8", "fr_FR.UTF-8", "German_Germany.1252"]
    with pytest.MonkeyPatch.context() as patch:
        if made_locales is not None:
            patch.setenv("LOCPATH", str(made_locales))
            names.insert(0, _MADE)
        for name in names:
            with contextlib.suppress(locale.Error):
                locale.setlocale(locale.LC_ALL, name)
                break
        else:
            not_run("no locale with a decimal comma (apt install locales or locales-all)")
        try:
            yield
        finally:
            locale.setlocale(locale.LC_ALL, before)

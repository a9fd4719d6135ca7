from __future__ import annotations

import contextlib
import locale
import shutil
import subprocess
from collections.abc import Iterator

import pytest


@pytest.fixture
def comma_locale(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Run the test in a locale with a decimal comma, made for it where none is installed."""
    before = locale.setlocale(locale.LC_ALL)
    names = ["de_DE.UTF-8", "fr_FR.UTF-8", "German_Germany.1252"]
    with pytest.MonkeyPatch.context() as patch:
        if shutil.which("localedef"):
            folder = tmp_path_factory.mktemp("locales")
            made = folder / "ocmm_comma.UTF-8"
            command = ["localedef", "--no-archive", "-i", "de_DE", "-f", "UTF-8", str(made)]
            if subprocess.run(command, capture_output=True, check=False).returncode == 0:
                patch.setenv("LOCPATH", str(folder))
                names.insert(0, made.name)
        for name in names:
            with contextlib.suppress(locale.Error):
                locale.setlocale(locale.LC_ALL, name)
                break
        else:
            pytest.skip("no locale with a decimal comma (apt install locales or locales-all)")
        try:
            yield
        finally:
            locale.setlocale(locale.LC_ALL, before)

"""Commands use the language of the reader of the terminal; output for programs stays English."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from ocmm_cli.terminal import language
from ocmm_core.settings import SettingsStore
from tests.host import HANG_S


def run(tmp_path: Path, *words: str, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {
        name: value
        for name, value in os.environ.items()
        if name not in ("OCMM_LANGUAGE", "LC_ALL", "LC_MESSAGES", "LANG")
    }
    homes = {name: str(tmp_path / name) for name in ("HOME", "XDG_CONFIG_HOME", "XDG_STATE_HOME")}
    return subprocess.run(
        [sys.executable, "-m", "ocmm_cli", *words],
        env=environment | homes | {"LANG": "C.UTF-8"} | more,
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
    )


def test_a_support_bundle_is_shown_in_german_and_packed_in_english(tmp_path: Path) -> None:
    file = tmp_path / "bundle.zip"
    done = run(tmp_path, "--language", "de", "support", "bundle", str(file), "--yes")
    assert done.returncode == 0, done.stderr
    assert "Namen von Personen wurden belassen." in done.stderr
    assert "Nichts wurde gesendet." in done.stdout
    assert "Nothing" not in done.stdout + done.stderr


def test_the_option_wins_over_the_locale_and_errors_follow_it(tmp_path: Path) -> None:
    # A pipe has no reader: the command refuses, in the requested language.
    words = ("support", "bundle", str(tmp_path / "b.zip"), "--without", "doctor")
    german = run(tmp_path, "--language", "de", *words, LANG="en_GB.UTF-8")
    assert "Nichts" in german.stderr or "nichts" in german.stderr
    english = run(tmp_path, "--language", "en", *words, LANG="de_DE.UTF-8")
    assert "Add --yes, or run it in a terminal." in english.stderr


def test_what_programs_read_is_english_in_every_language(tmp_path: Path) -> None:
    plain = run(tmp_path, "settings", "show", "--json")
    german = run(tmp_path, "settings", "show", "--json", LANG="de_DE.UTF-8")
    assert json.loads(german.stdout) == json.loads(plain.stdout)


def test_the_setting_of_the_window_is_that_of_the_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert language({"LANG": "de_DE.UTF-8"}) == "de"
    SettingsStore.of_this_user().change({"window.language": "en"})
    assert language({"LANG": "de_DE.UTF-8"}) == "en"
    assert language({"LANG": "C", "OCMM_LANGUAGE": "de"}) == "de"

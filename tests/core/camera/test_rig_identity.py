"""Documents that another program replaces while they are read."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from ocmm_core.calibration.records import open_design
from ocmm_core.camera import load_rig
from ocmm_core.documents import digest, resource, text_digest, write_atomic


@pytest.fixture
def replaced(tmp_path: Path) -> Iterator[tuple[Path, dict[str, str]]]:
    """Give a rig document that is replaced again and again, and the identity of each name."""
    text = resource("rigs", "recommended.toml").read_text("utf-8")
    path, ended = tmp_path / "rig.toml", threading.Event()
    versions = [text, text.replace('name = "', 'name = "other-', 1)]
    identities = {}
    for version in versions:
        path.write_text(version, "utf-8")
        identities[load_rig(path).name] = digest(path)

    def replace() -> None:
        while not ended.is_set():
            for version in versions:
                write_atomic(path, version.encode())

    writer = threading.Thread(target=replace)
    writer.start()
    yield path, identities
    ended.set()
    writer.join()


def test_a_rig_has_the_identity_of_what_was_read(replaced: tuple[Path, dict[str, str]]) -> None:
    path, identities = replaced
    found = {(rig.name, rig.identity) for rig in (load_rig(path) for _ in range(300))}
    assert found == set(identities.items())


def test_a_job_gets_the_text_of_the_rig_it_measures_with(
    replaced: tuple[Path, dict[str, str]],
) -> None:
    found = set()
    for _ in range(100):
        design = open_design(replaced[0])
        assert text_digest(design.rig_text) == design.rig.identity
        found.add(design.rig.identity)
    assert found == set(replaced[1].values())

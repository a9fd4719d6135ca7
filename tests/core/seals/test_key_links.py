"""Links in place of the files of a key: a sentence, never another key."""

from __future__ import annotations

from pathlib import Path

import pytest

from ocmm_core.errors import StorageError
from ocmm_core.seals import KeyFolder
from ocmm_core.seals._private_file import guarded_content


@pytest.mark.parametrize("secret", [True, False])
@pytest.mark.parametrize("target", ["nothing", "/proc/self/mem"])
def test_refuses_a_link_that_cannot_be_read(tmp_path: Path, target: str, secret: bool) -> None:
    file = tmp_path / "station.key"
    file.symlink_to(target)
    with pytest.raises(StorageError, match="cannot be read"):
        guarded_content(file, "list of keys", secret=secret)


def test_makes_no_key_in_place_of_a_link_to_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "keys"
    folder.mkdir(mode=0o700)
    (folder / "station.key").symlink_to(folder / "nothing")
    with pytest.raises(StorageError, match="cannot be read"):
        KeyFolder(folder).station_key()
    assert [one.name for one in folder.iterdir()] == ["station.key"]

"""Records and tables of a calibration, read from bytes and files."""

from __future__ import annotations

import hashlib
from pathlib import Path

from ocmm_core.calibration.records import CameraRecord, canonical, rig_from_record
from ocmm_core.calibration.records._sealed import unseal
from ocmm_core.camera import Rig
from ocmm_core.tables import NamedColumns, TextTable, read_table
from tests.core.calibration.made_records import make_record


def sample_record() -> bytes:
    """Return the content of a record of cameras."""
    return canonical(make_record())


def rig_of_content(content: bytes) -> Rig:
    """Return the cameras of a hand-made record with a correct hash."""
    digest = hashlib.sha256(content).hexdigest().encode()
    sealed = b'{"content":' + content + b',"sha256":"' + digest + b'"}'
    return rig_from_record(unseal(Path("record.json"), sealed, CameraRecord))


def read_list(path: Path) -> TextTable:
    """Return a table of named points."""
    return read_table(path, NamedColumns(("name", "x"), ("x",)))

"""Non-volatile memory of a software camera: named blocks with checksums."""

from __future__ import annotations

import zlib
from pathlib import Path

from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import StorageError

_CRC_BYTES = 4


class CameraStore:
    """Flash memory of one camera: a file per block in `folder`, or in memory if None.

    Pass the same object after a power cycle.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder
        self._blocks: dict[str, bytes] = {}

    def save(self, name: str, content: bytes) -> None:
        """Store `content` atomically; raise StorageError on failure."""
        block = zlib.crc32(content).to_bytes(_CRC_BYTES, "little") + content
        if self._folder is None:
            self._blocks[name] = block
            return
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            write_atomic(self._path(self._folder, name), block)
        except OSError as error:
            raise _unwritable(name, error) from error

    def load(self, name: str) -> bytes | None:
        """Return the content, or None; raise StorageError if damaged."""
        if self._folder is None:
            block = self._blocks.get(name)
        else:
            path = self._path(self._folder, name)
            block = read_bytes(path) if path.exists() else None
        if block is None:
            return None
        content = block[_CRC_BYTES:]
        if zlib.crc32(content).to_bytes(_CRC_BYTES, "little") != block[:_CRC_BYTES]:
            raise StorageError(
                "camera.stored",
                f"The {name} that the camera keeps is damaged.",
                "Write or measure it again.",
            )
        return content

    def forget(self, name: str) -> None:
        """Delete the content; raise StorageError on failure."""
        self._blocks.pop(name, None)
        if self._folder is None:
            return
        try:
            self._path(self._folder, name).unlink(missing_ok=True)
        except OSError as error:
            raise _unwritable(name, error) from error

    @staticmethod
    def _path(folder: Path, name: str) -> Path:
        return folder / f"{name.replace(' ', '_')}.bin"


def _unwritable(name: str, error: OSError) -> StorageError:
    return StorageError(
        "camera.stored",
        f"The camera cannot keep its {name} ({error.strerror}).",
        "Check the folder of the software camera.",
    )

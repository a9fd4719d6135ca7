"""The server of the product by the door that users take: `ocmm serve ippdme` in a process."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from tests.host import HANG_S


class ServedProcess:
    """A running server; `address` is known when it listens."""

    def __init__(self, command: str, out: Path, *options: str) -> None:
        self.lines: list[str] = []
        """Printed lines, errors included."""
        self._process = subprocess.Popen(
            [sys.executable, "-m", "ocmm_cli", "serve", command, "--out", str(out), *options],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "300"},
        )  # fmt: skip
        assert self._process.stdout is not None
        self._output = self._process.stdout
        found = None
        for line in self._output:
            self.lines.append(line.rstrip("\n"))
            if found := re.search(r"\b127\.0\.0\.1:(\d+)", line):
                break
        if found is None:
            code = self._process.wait(HANG_S)
            self._output.close()
            raise AssertionError(f"it ended with {code}: " + "\n".join(self.lines))
        self.address = ("127.0.0.1", int(found[1]))
        self._reader = threading.Thread(target=self._read, name="reads-the-server")
        self._reader.start()

    def _read(self) -> None:
        for line in self._output:
            self.lines.append(line.rstrip("\n"))

    @property
    def text(self) -> str:
        return "\n".join(self.lines)

    @property
    def running(self) -> bool:
        return self._process.poll() is None

    def stop(self, number: int = signal.SIGTERM) -> int:
        """End it by a signal, and return its exit code."""
        if self._process.poll() is None:
            self._process.send_signal(number)
        code = self._process.wait(HANG_S)
        self._reader.join(HANG_S)
        self._output.close()
        return code

    def kill(self) -> None:
        """End it as a power cut would."""
        self.stop(signal.SIGKILL)


@contextmanager
def served(out: Path, *options: str, command: str = "ippdme") -> Iterator[ServedProcess]:
    """Serve the virtual rig until the end of the block; it must end well and without traceback."""
    server = ServedProcess(command, out, "--source", "simulated", "--port", "0", *options)
    try:
        yield server
    finally:
        code = server.stop()
    assert code == 0, server.text
    assert "Traceback" not in server.text, server.text


def jobs_in(folder: Path) -> Sequence[Path]:
    """Return the job files of a folder, oldest first."""
    return sorted(folder.rglob("*.ocmm"))

"""An unforeseen exception, raised at each of many places of the measuring chain.

Each case is the real command on the virtual rig; one of its functions raises after some points were
taken. A reader polls the station meanwhile, as a window does. An error in a part essential for
measuring makes the station FAILED, one in a side task is reported, and in both cases every
acknowledged point is in the job file, and the command ends with code 3 and the true cause.
"""

from __future__ import annotations

import importlib
import io
import json
import re
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ocmm_cli import main
from ocmm_cli.measure import run_job
from ocmm_core.composition import BuiltStation
from ocmm_core.documents import resource
from ocmm_core.errors import InternalError, OcmmError
from ocmm_core.inspection.evaluation import JobView, LiveView, StatusWord
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.station import MeasuringStation
from ocmm_core.storage import JobFile
from ocmm_gui.bridge import Evaluator
from tests.host import BUSY, HANG_S
from tests.short_plan import TOUCHES, ball_plan_in

QUICK = resource("plans", "quick.toml")
BEFORE = 3
"""So many points are taken before something fails."""
SHOWN_S = 0.2
PATIENCE_S = HANG_S
MESSAGE = "injected for the test"

pytestmark = pytest.mark.timing

STREAM = ("--stream", "0")
FAILED, BESIDE, COMMAND = "failed", "beside", "command"


@dataclass(frozen=True)
class Place:
    """The place of an exception, the exception, and its consequences."""

    where: str
    raises: type[Exception]
    becomes: str = FAILED
    more: tuple[str, ...] = ()


PLACES = (
    # Tracking, and the snapshot of it.
    Place("ocmm_core.tracking._pipeline.TrackingPipeline.process", ValueError),
    Place("ocmm_core.tracking._body_tracker.solve_leds", ZeroDivisionError),
    Place("ocmm_core.tracking._pipeline.TrackingPipeline.slot_leds", RuntimeError),
    Place("ocmm_core.station._live.tip_sensitivities", FloatingPointError),
    Place("ocmm_core.station._live.LiveState._judge_tip", TypeError),
    # Trigger and point.
    Place("ocmm_core.measuring._trigger.TouchCollector.push", IndexError),
    Place("ocmm_core.inspection.session._session.average", ArithmeticError),
    Place("ocmm_core.inspection.session._touch_filter.judge_touch", KeyError),
    Place("ocmm_core.inspection.session._assignment.assign_touch", AttributeError),
    Place("ocmm_core.inspection.session._session.TouchIntake.record_touch", RecursionError),
    # Storage.
    Place("ocmm_core.storage._tables.insert_point", MemoryError),
    Place("ocmm_core.storage._audit.insert_audited", OverflowError),
    Place("ocmm_core.inspection.session._step_log.deed_event", ValueError),
    # Fit and evaluation.
    Place("ocmm_core.features.measured._actual.compensation", np.linalg.LinAlgError),
    Place("ocmm_core.inspection.evaluation.evaluate_job", RuntimeError),
    Place("ocmm_core.inspection.evaluation._evaluation.evaluate_one", ValueError),
    Place("ocmm_core.inspection.evaluation._evaluation.joint_factors", MemoryError),
    Place("ocmm_core.inspection.evaluation.coverage_of", IndexError),
    Place("ocmm_core.inspection.evaluation.targets_of", ZeroDivisionError),
    # Monitor and watches.
    Place("ocmm_core.calibration.monitor._monitor.CalibrationMonitor.push", ValueError),
    Place("ocmm_core.calibration.guided._session_events.ShockDetector.push", OSError),
    Place("ocmm_core.calibration.records.judge", LookupError),
    Place("ocmm_core.station._calibration_watch.judge", AssertionError),
    Place("ocmm_core.station.stream._messages.ButtonWatch.push", NotImplementedError),
    # Acquisition.
    Place("ocmm_sim.scene._source.SimulatedSource.read", EOFError),
    Place("ocmm_core.acquisition.frames._ring.FrameRing.read", BufferError),
    Place("ocmm_core.acquisition.frames._ring.FrameRing.write", ValueError),
    # Recorder, stream and listeners run in parallel.
    Place(
        "ocmm_core.acquisition.recording._recording.encode_chunk",
        RuntimeError,
        BESIDE,
        ("--record", "r"),
    ),
    Place("ocmm_core.station.stream._messages.pose_line", TypeError, BESIDE, STREAM),
    Place("ocmm_core.station.stream._messages.point_line", MemoryError, BESIDE, STREAM),
    Place("ocmm_core.station.stream._client.StreamClient.write", KeyError, BESIDE, STREAM),
    Place(f"{__name__}.listen", ValueError, BESIDE),
    # Export, and the command itself.
    Place("ocmm_core.station._job.reported_features", ValueError, COMMAND),
    Place("ocmm_core.export.report._polyworks._points", ZeroDivisionError, COMMAND),
    Place("ocmm_core.export._registry.write_together", RuntimeError, COMMAND),
    Place("ocmm_cli.measure.print_table", EOFError, COMMAND),
)


def listen(point: MeasuredPoint) -> None:
    """Listen to the points, as another program's part of the station would."""


@dataclass
class Trap:
    """Raises at a place, once it is armed; the time of the first raise is kept."""

    place: Place
    armed: threading.Event = field(default_factory=threading.Event)
    raised_at: float | None = None

    def set(self, patch: pytest.MonkeyPatch) -> None:
        owner, name = _owner(self.place.where)
        real = getattr(owner, name)

        def trapped(*arguments: Any, **named: Any) -> Any:
            if self.armed.is_set():
                if self.raised_at is None:
                    self.raised_at = time.monotonic()
                raise self.place.raises(MESSAGE)
            return real(*arguments, **named)

        patch.setattr(owner, name, trapped)


def _owner(where: str) -> tuple[Any, str]:
    path, _, name = where.rpartition(".")
    try:
        return importlib.import_module(path), name
    except ModuleNotFoundError:
        module, _, kind = path.rpartition(".")
        return getattr(importlib.import_module(module), kind), name


class Reader:
    """Looks at a station as a window does: snapshots by polling, results after every change."""

    def __init__(self, built: BuiltStation, trap: Trap) -> None:
        self.station: MeasuringStation = built.station
        self.job_path = built.job_path
        self.seen: list[tuple[float, LiveView]] = []
        self.jobs: list[JobView] = []
        self.told: list[OcmmError] = []
        self.acknowledged: list[int] = []
        self._trap = trap
        self._digits = threading.Event()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._poll, name="reader")
        self._evaluator = Evaluator(self.station.job.view, self.jobs.append, self._not_evaluated)
        self._client: socket.socket | None = None
        self.station.faults.failed.connect(self.told.append)
        self.station.events.point_taken.connect(self._taken)
        self.station.events.point_taken.connect(lambda point: listen(point))
        self.station.events.changed.connect(self._evaluator.wake)

    def __enter__(self) -> Reader:
        self._thread.start()
        self._evaluator.start()
        return self

    def __exit__(self, *_: object) -> None:
        # Also after the end of the command nothing may come back.
        until = time.monotonic() + 0.05
        while time.monotonic() < until:
            time.sleep(0.005)
        self._stop.set()
        self._thread.join()
        self._evaluator.close(PATIENCE_S)
        if self._client is not None:
            self._client.close()

    def _not_evaluated(self, error: Exception) -> None:
        self.station.faults.fail(error, "The evaluation")

    def _taken(self, point: MeasuredPoint) -> None:
        self.acknowledged.append(point.number)
        if len(self.acknowledged) == 1 and self.station.stream is not None:
            self._client = socket.create_connection(self.station.stream.address, PATIENCE_S)
            self._client.sendall(json.dumps({"poses": True}).encode() + b"\n")
        if len(self.acknowledged) == BEFORE:
            # The screen now shows digits that could remain.
            assert self._digits.wait(PATIENCE_S)
            self._trap.armed.set()
            if self._trap.place.becomes == BESIDE and "stream" in self._trap.place.where:
                # The script of the virtual rig is over sooner than a client of it is served.
                self._await_raise()

    def _await_raise(self) -> None:
        until = time.monotonic() + PATIENCE_S
        while not self.station.faults.beside and time.monotonic() < until:
            if "point_line" in self._trap.place.where:
                return
            time.sleep(0.005)

    def _poll(self) -> None:
        while not self._stop.is_set():
            began = time.monotonic()
            live = self.station.looks.live()
            self.seen.append((began, live))
            if live.tip_world is not None:
                self._digits.set()
            time.sleep(0.005)


@dataclass(frozen=True)
class Ended:
    """Leftovers of a command."""

    code: int
    out: str
    err: str
    reader: Reader


@pytest.fixture
def run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], slow: Path
) -> Callable[[Trap], Ended]:
    """Return a runner of ``ocmm measure`` with a trap in it and a parallel reader."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "stdin", io.StringIO())

    def ended(trap: Trap) -> Ended:
        readers: list[Reader] = []

        def watched(built: BuiltStation, *arguments: Any, **named: Any) -> JobView:
            with Reader(built, trap) as reader:
                readers.append(reader)
                return run_job(built, *arguments, **named)

        monkeypatch.setattr("ocmm_cli.measure.run_job", watched)
        trap.set(monkeypatch)
        plan = str(ball_plan_in(tmp_path))
        command = ["ocmm", "measure", "--plan", plan, "--rig", str(slow), "--out", "out"]
        monkeypatch.setattr(sys, "argv", [*command, *trap.place.more])
        capfd.readouterr()
        with pytest.raises(SystemExit) as end:
            main()
        out, err = capfd.readouterr()
        return Ended(int(end.value.code or 0), out, err, readers[0])

    return ended


@pytest.fixture(scope="module")
def slow(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the recommended rig with a twentieth of the frames: speed does not matter here."""
    text = resource("rigs", "recommended.toml").read_text("utf-8")
    file = tmp_path_factory.mktemp("rig") / "slow.toml"
    file.write_text(text.replace("frame_rate_hz = 8000", "frame_rate_hz = 400"), "utf-8")
    return file


@pytest.mark.parametrize("place", PLACES, ids=lambda place: ".".join(place.where.split(".")[1:]))
def test_an_exception_is_shown_stops_the_digits_and_loses_no_point(
    run: Callable[[Trap], Ended], place: Place, record_property: Callable[[str, object], None]
) -> None:
    trap = Trap(place)
    ended = run(trap)
    reader, station = ended.reader, ended.reader.station
    assert trap.raised_at is not None, "the place was never reached"

    assert ended.code == 3, ended.err
    cause = f"{place.raises.__name__}: "
    assert cause in ended.err
    assert MESSAGE in ended.err
    assert "Traceback (most recent" not in ended.out + ended.err
    log = re.search(r"Log for support: (\S+\.log)", ended.err)
    assert log is not None, ended.err
    text = Path(log[1]).read_text("utf-8")
    assert "Traceback (most recent call last)" in text
    assert cause in text

    with JobFile.open(reader.job_path, read_only=True) as job:
        kept = {point.number for point in job.points()}
        assert job.verify() == []
    assert set(reader.acknowledged) <= kept
    assert len(reader.acknowledged) >= BEFORE

    if place.becomes == COMMAND:
        assert len(reader.acknowledged) == TOUCHES
        assert "All points taken are saved in the job file." in ended.err
        return
    fault = station.faults.measuring
    if place.becomes == BESIDE:
        assert fault is None
        (fault,) = station.faults.beside
    assert fault is not None
    since = [(began, live) for began, live in reader.seen if began >= trap.raised_at]
    shown = [began for began, live in since if live.status is StatusWord.FAILED]
    delay = min([fault.at_s, *shown]) - trap.raised_at
    record_property("shown after, ms", f"{1e3 * delay:.2f}")
    assert 0.0 <= delay < BUSY * SHOWN_S
    assert isinstance(fault.error, InternalError)
    assert [error.what for error in reader.told] == [fault.error.what]

    after = [live for began, live in reader.seen if began >= fault.at_s]
    assert after, "nobody looked"
    if place.becomes == BESIDE:
        assert len(reader.acknowledged) == TOUCHES
        assert station.job.view().complete
        assert all(live.faults == (fault.error.what,) for live in after)
        assert all(live.status is not StatusWord.FAILED for live in after)
        return
    assert {live.status for live in after} == {StatusWord.FAILED}
    assert [live.tip_world for live in after if live.tip_world is not None] == []
    assert all(MESSAGE in live.reason and str(reader.job_path) in live.reason for live in after)
    late = [live for began, live in reader.seen if began >= trap.raised_at + SHOWN_S]
    assert [live for live in late if live.tip_world is not None] == []
    assert f"All points taken are saved in {reader.job_path.absolute()}." in fault.error.remedy


def test_the_command_line_as_a_process_ends_with_code_3(tmp_path: Path) -> None:
    """The same in a separate process, without pytest in between."""
    program = (
        "import ocmm_core.inspection.evaluation as module\n"
        "from ocmm_cli import main\n"
        "def targets_of(*a): raise ZeroDivisionError('injected for the test')\n"
        "module.targets_of = targets_of\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, "demo", "--headless", "--plan", str(QUICK)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=HANG_S,
        check=False,
    )
    assert done.returncode == 3
    assert "ZeroDivisionError: injected for the test (" in done.stderr
    assert "Traceback" not in done.stdout + done.stderr


def test_the_bus_process_ends_with_code_3() -> None:
    program = (
        "import ocmm_core.acquisition.bus_process._process as module\n"
        "from ocmm_core.acquisition.bus_process._start import main\n"
        "def read_config(content): raise KeyError('injected for the test')\n"
        "module.read_config = read_config\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        input="{}\n",
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
    )
    assert done.returncode == 3
    assert "The bus process failed: KeyError: 'injected for the test' (" in done.stderr
    assert "Traceback" not in done.stderr

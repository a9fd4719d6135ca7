"""Messages of the live stream: one JSON object a line, for programs in any language.

Lengths in mm, world frame (of the cameras, or of the job with a reference body). Every message has
``v`` (version of the format) and ``type``:

``hello``
    First line of the server: ``stream`` (changes with each start of the server), ``job``,
    ``first_seq`` and ``last_seq`` of resumable messages, ``token_needed``, ``simulated``.
``point``
    A durable point: ``seq``, ``number``, ``feature``, ``t``, ``pos`` (ball centre), ``surface``
    (compensated), ``dir`` (leaves the material), ``tip_radius``, ``approach``, ``cov`` (of the
    window), ``n_markers``, ``n_frames``.
``annulled``
    A point that no longer counts: ``seq``, ``number``.
``button``
    The button of the probe went down or up: ``seq``, ``event`` (``press`` or ``release``),
    ``frame``, ``t``, and ``held_s`` of a release whose press was seen, else null.
``status``
    The state of the machine has changed: ``job``, ``status``, ``reason``, ``t``.
``verdict``
    The job was evaluated after a change: ``job``, ``after`` (includes everything up to this
    ``seq``), ``part`` (word of the verdict on the part), ``verdict`` (the same in the words of the
    characteristics), ``complete``, ``missing``, ``not_conform``, ``not_proven`` (names),
    ``simulated``, ``unproven``, ``camera_doubts`` (unproven properties of the cameras, sentences),
    ``features`` (``name``, ``state``, ``verdict``, ``deciding``), ``characteristics`` (``name``,
    ``verdict``), and ``reason``: why there is no verdict, if ``part`` is null.
``pose``
    Current state: ``frame``, ``t``, ``status``, ``reason``, ``btn`` (button down), and ``pos``,
    ``q`` (x, y, z, w; world from probe), ``u`` (expanded, k = 2): null unless the number can be
    trusted.
``bye``
    Last line of the server, with the reason.

The stream does not know the station: it reads interfaces. The verdict is evaluated on its own
thread (seconds); bursts become one evaluation.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

import msgspec
import numpy as np
import scipy
from psygnal import SignalInstance

from ocmm_core.acquisition.frames import FrameBlock, FrameFlag
from ocmm_core.errors import InputError
from ocmm_core.failure import contained
from ocmm_core.inspection.evaluation import FeatureView, JobView, LiveView
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.storage import JobStep
from ocmm_core.tolerances.decisions import Verdict, VerdictSummary

VERSION = 1
UNITS = "mm"


_LARGEST = 2**53
"""Larger integers are not exact in every language that reads JSON."""


class Request(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """First line of a client."""

    resume: int = 0
    """Last sequence number received: everything after it is sent. Zero for all."""
    token: str = ""
    """Required if the server listens beyond this computer."""
    poses: bool = True


@dataclass(frozen=True, slots=True)
class Hello:
    """First line of the server; see the module."""

    stream: str
    job: str
    first_seq: int
    last_seq: int
    token_needed: bool
    simulated: bool


def read_request(line: bytes) -> Request:
    """Return the request of a client, everything if empty; InputError if invalid."""
    if not line.strip():
        return Request()
    try:
        request = msgspec.json.decode(line, type=Request)
    except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
        raise InputError(
            "stream.request",
            f"The first line is not a request ({error}).",
            'Send one line such as {"resume": 0}.',
        ) from error
    if not 0 <= request.resume <= _LARGEST:
        raise InputError(
            "stream.request", f"'resume' is {request.resume}.", "Send the last number you received."
        )
    return request


def hello_line(hello: Hello) -> bytes:
    return _line(
        "hello",
        stream=hello.stream, job=hello.job, first_seq=hello.first_seq, last_seq=hello.last_seq,
        token_needed=hello.token_needed, simulated=hello.simulated, units=UNITS,
        frame_id="world",
    )  # fmt: skip


def point_line(seq: int, job: str, point: MeasuredPoint) -> bytes:
    return _line(
        "point",
        seq=seq, job=job, number=point.number, feature=point.feature, t=point.time_s,
        pos=point.tip_world.tolist(), surface=point.surface_world.tolist(),
        dir=point.direction.tolist(), tip_radius=point.tip_radius, approach=point.approach,
        cov=point.random_covariance.tolist(), n_markers=int(point.seen.any(axis=0).sum()),
        n_frames=point.n_frames, units=UNITS, frame_id="world",
    )  # fmt: skip


def annulled_line(seq: int, job: str, number: int) -> bytes:
    return _line("annulled", seq=seq, job=job, number=number)


def button_line(seq: int, job: str, change: ButtonChange) -> bytes:
    return _line(
        "button",
        seq=seq, job=job, event=change.event, frame=change.frame, t=change.time_s,
        held_s=change.held_s,
    )  # fmt: skip


def status_line(job: str, live: LiveView) -> bytes:
    return _line("status", job=job, t=live.time_s, status=live.status.value, reason=live.reason)


def verdict_line(view: JobView, after: int) -> bytes:
    """Return the line of a job's verdicts, including everything up to a sequence number."""
    part = view.part_verdict
    return _line(
        "verdict",
        job=view.job, after=after, part=part.headline, verdict=_word(part.verdict),
        requirements=part.requirement_words, complete=part.complete, missing=part.missing,
        not_conform=part.failing, not_proven=part.unproven, simulated=view.simulated,
        unproven=view.unproven, camera_doubts=view.camera_doubts,
        features=[_feature(item, view.verdict_of(item.name)) for item in view.features],
        characteristics=[
            {"name": item.name, "verdict": item.verdict.value} for item in view.characteristics
        ],
        reason="",
    )  # fmt: skip


def no_verdict_line(job: str, after: int, reason: str) -> bytes:
    """Return the line that revokes earlier verdicts: the job cannot be evaluated."""
    return _line("verdict", job=job, after=after, part=None, verdict=None, reason=reason)


def _feature(feature: FeatureView, summary: VerdictSummary) -> dict[str, str | None]:
    return {
        "name": feature.name,
        "state": feature.state.value,
        "verdict": _word(summary.verdict),
        "deciding": summary.deciding,
    }


def _word(verdict: Verdict | None) -> str | None:
    return None if verdict is None else verdict.value


def pose_line(live: LiveView, *, pressed: bool) -> bytes:
    """Return the line of the current state; numbers only if trusted."""
    trusted = live.tip_world is not None and live.rotation_world_from_probe is not None
    quaternion = None
    if trusted:
        matrix = np.asarray(live.rotation_world_from_probe)
        turn = scipy.spatial.transform.Rotation.from_matrix(matrix)
        quaternion = turn.as_quat(canonical=True).tolist()
    return _line(
        "pose",
        frame=live.frame_counter, t=live.time_s, status=live.status.value, reason=live.reason,
        btn=pressed,
        pos=live.tip_world.tolist() if trusted and live.tip_world is not None else None,
        q=quaternion, u=live.tip_uncertainty if trusted else None, units=UNITS, frame_id="world",
    )  # fmt: skip


def bye_line(why: str) -> bytes:
    return _line("bye", why=why)


def _line(kind: str, **fields: object) -> bytes:
    return msgspec.json.encode({"v": VERSION, "type": kind, **fields}) + b"\n"


@dataclass(frozen=True, slots=True)
class ButtonChange:
    event: Literal["press", "release"]
    frame: int
    time_s: float
    """`frame`, `time_s`: Exposure of its first detection, and its bus time, s."""
    held_s: float | None = None
    """Of a release: duration; None if the press was not seen, and for a press."""


class ButtonWatch:
    """Find every change of the button in consecutive frames; for one thread.

    After missing frames a change is reported with the first frame. A button that is down in the
    very first frame was pressed before, and only its release is reported.
    """

    def __init__(self) -> None:
        self._down: bool | None = None
        self._since_s: float | None = None

    def push(self, block: FrameBlock) -> list[ButtonChange]:
        changes: list[ButtonChange] = []
        down = (block.flags & FrameFlag.BUTTON) != 0
        if self._down is None:
            self._down = bool(down[0])
        if bool(down.any()) == self._down == bool(down.all()):
            return changes
        for index, is_down in enumerate(down.tolist()):
            if is_down is self._down:
                continue
            self._down = is_down
            frame, time_s = int(block.counter[index]), float(block.time_ns[index]) * 1e-9
            if is_down:
                self._since_s = time_s
                changes.append(ButtonChange("press", frame, time_s))
            else:
                since_s, self._since_s = self._since_s, None
                # A bus clock reset meanwhile invalidates the duration.
                held_s = None if since_s is None or time_s < since_s else time_s - since_s
                changes.append(ButtonChange("release", frame, time_s, held_s))
        return changes


class StreamedEvents(Protocol):
    @property
    def changed(self) -> SignalInstance:
        """Emitted after every change of the job."""
        ...

    @property
    def button(self) -> SignalInstance:
        """Emitted with a `ButtonChange` when the button of the probe goes down or up."""
        ...


class StreamedJob(Protocol):
    """The current job."""

    @property
    def path(self) -> Path: ...

    def view(self) -> JobView:
        """Return the current job; takes up to some seconds."""
        ...

    def steps_since(self, job: Path | None, after: int) -> tuple[Path, list[JobStep]]:
        """Return job and steps after an audit row, from 0 if another; empty only if no more."""
        ...


class StreamedLooks(Protocol):
    def live(self) -> LiveView: ...


class StreamedInstruments(Protocol):
    @property
    def simulated(self) -> bool:
        """Return whether the frames come from a virtual rig, as far as is known by now."""
        ...


class StreamSource(Protocol):
    """Source of the stream, e.g. the measuring station."""

    @property
    def events(self) -> StreamedEvents: ...

    @property
    def job(self) -> StreamedJob: ...

    @property
    def looks(self) -> StreamedLooks: ...

    @property
    def instruments(self) -> StreamedInstruments: ...


class StepReader:
    """Read every step of the jobs of a station once, in order; for one thread at a time."""

    def __init__(self, job: StreamedJob) -> None:
        self._source = job
        self.path: Path | None = None
        """Current job; None before the first read."""
        self._after = 0

    def read(self) -> Iterator[tuple[str, JobStep]]:
        """Yield new steps with the name of their job; after an error, a step comes again."""
        while True:
            path, steps = self._source.steps_since(self.path, self._after)
            if path != self.path:
                # Rows of another job are numbered separately.
                self.path, self._after = path, 0
            if not steps:
                return
            for step in steps:
                yield path.stem, step
                self._after = step.sequence


PAUSE_S = 0.1
"""Minimum pause between two evaluations, so that the stream never takes a whole processor."""


@dataclass(frozen=True, slots=True)
class ToldVerdict:
    """Latest line, and the count of lines so far."""

    count: int = 0
    line: bytes = b""


class VerdictWatch:
    """Evaluate a job on request.

    `last_seq` returns the number of the latest message that an evaluation now would include; `made`
    is called on the thread of the watch when there is a new line.
    """

    def __init__(
        self,
        evaluate: Callable[[], JobView],
        job: Callable[[], str],
        last_seq: Callable[[], int],
        made: Callable[[], None],
    ) -> None:
        self._evaluate, self._job = evaluate, job
        self._last_seq, self._made = last_seq, made
        self._asked = threading.Event()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ocmm-stream-verdict")
        self.latest = ToldVerdict()

    def start(self) -> None:
        self._thread.start()

    def request(self) -> None:
        """Request an evaluation; returns at once."""
        self._asked.set()

    def close(self, timeout_s: float) -> bool:
        """Stop, finishing a running evaluation, and return whether the thread ended in time."""
        self._stopping.set()
        self._asked.set()
        if self._thread.ident is not None:
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while True:
            self._asked.wait()
            if self._stopping.is_set():
                return
            self._asked.clear()
            self.latest = ToldVerdict(self.latest.count + 1, self._line())
            self._made()
            self._stopping.wait(PAUSE_S)

    def _line(self) -> bytes:
        # Read first: the view fetched next contains everything up to this number.
        after = self._last_seq()
        try:
            return verdict_line(self._evaluate(), after)
        except Exception as error:
            # Without this the previous verdict would stand, which may not hold any more.
            told = contained(error, "The verdict for the stream")
            return no_verdict_line(self._job(), after, f"{told.what} {told.remedy}")

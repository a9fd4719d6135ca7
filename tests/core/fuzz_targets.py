"""Parsers with good samples: each takes bytes, and gives a result or an error of the product."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.acquisition.recording import BusCapture
from ocmm_core.camera import load_rig
from ocmm_core.chain_file import ChainFile
from ocmm_core.documents import resource
from ocmm_core.export.report import load_profile
from ocmm_core.features.shapes import read_points_file
from ocmm_core.fieldbus.objects import ObjectRequest, decode_request, encode_line
from ocmm_core.fieldbus.wire import decode_frame
from ocmm_core.inspection.plan import feature_table, load_plan
from ocmm_core.storage import JobFile, JobHead, read_summary
from ocmm_core.tracking import load_probe, load_reference
from ocmm_sim.scene import load_part
from tests.core.acquisition.recording_samples import read_recording, sample_recording
from tests.core.acquisition.test_capture import bringup, steady, write_pcap, write_pcapng
from tests.core.calibration.record_parsers import read_list, rig_of_content, sample_record
from tests.core.storage.conftest import sample_point

Parse = Callable[[bytes], object]


@dataclass(frozen=True, slots=True)
class Parser:
    """Good samples, and how a parser is had that reads contents in a folder."""

    samples: tuple[bytes, ...]
    opened: Callable[[Path], Parse]


def _from_file(read: Callable[[Path], object], name: str) -> Callable[[Path], Parse]:
    def opened(folder: Path) -> Parse:
        path = folder / name

        def parse(content: bytes) -> object:
            path.write_bytes(content)
            return read(path)

        return parse

    return opened


def _documents(folder: str) -> tuple[bytes, ...]:
    return tuple(path.read_bytes() for path in sorted(resource(folder).glob("*.toml")))


def _job() -> Parser:
    folder = Path(tempfile.mkdtemp())
    try:
        path = folder / "a.ocmm"
        head = JobHead("a", "2024-05-06T07:08:09+00:00", *"cdefghi")
        with JobFile.create(path, head) as job:
            for number in (1, 2, 3):
                job.append_point(sample_point(number))
            job.append_event("note", "a text")
        samples = (path.read_bytes(),)
    finally:
        shutil.rmtree(folder)

    def read(path: Path) -> object:
        for beside in path.parent.glob(f"{path.name}-*"):
            beside.unlink()
        os.utime(path, (1e9, 1e9))
        read_summary(path)
        with JobFile.open(path) as job:
            job.verify()
            return job.points(), job.annulled(), job.events(), job.taken_utc(), job.steps()

    return Parser(samples, _from_file(read, "a.ocmm"))


def _chain(folder: Path) -> Parse:
    path = folder / "chain.jsonl"

    def parse(content: bytes) -> object:
        path.write_bytes(content)
        return ChainFile(path, ObjectRequest).items

    return parse


def _chain_sample() -> Parser:
    folder = Path(tempfile.mkdtemp())
    try:
        chain = ChainFile(folder / "chain.jsonl", ObjectRequest)
        for number in (1, 2):
            chain.append(ObjectRequest(number, "left", 0x1018, 4, bytes(4)))
        return Parser((chain.path.read_bytes(),), _chain)
    finally:
        shutil.rmtree(folder)


def _capture() -> Parser:
    folder = Path(tempfile.mkdtemp())
    try:
        path = folder / "bus.pcap"
        samples = []
        for write in (write_pcap, write_pcapng):
            write(path, bringup() + steady(2))
            samples.append(path.read_bytes())
    finally:
        shutil.rmtree(folder)
    return Parser(
        tuple(samples), _from_file(lambda path: list(BusCapture(path).blocks()), "bus.pcap")
    )


def _lines() -> Parser:
    samples = (encode_line(ObjectRequest(1, "left", 0x1018, 4, bytes(40))),)
    return Parser(samples, lambda folder: decode_request)


_ROWS = "".join(f"{x} {y} {0.001 * x * y}\n" for x in range(5) for y in range(5)).encode()
_TABLE = b"name;shape;x;y;z;diameter\nS1;Sphere;0,5;0;0;20\nC1;Circle;1;2;3;4\n"
_LIST = b"# unit: mm\nname,x,y,z\nA,1,2,3\nB,4,5,6.5\n"

PARSERS: dict[str, Callable[[], Parser]] = {
    "capture": _capture,
    "chain": _chain_sample,
    "frames": lambda: Parser(tuple(bringup() + steady(1)), lambda folder: decode_frame),
    "job": _job,
    "lines": _lines,
    "list": lambda: Parser((_LIST,), _from_file(read_list, "list.csv")),
    "part": lambda: Parser(_documents("parts"), _from_file(load_part, "part.toml")),
    "plan": lambda: Parser(_documents("plans"), _from_file(load_plan, "plan.toml")),
    "points": lambda: Parser((_ROWS, b"25\n" + _ROWS), _from_file(read_points_file, "p.txt")),
    "probe": lambda: Parser(_documents("probes"), _from_file(load_probe, "probe.toml")),
    "profile": lambda: Parser(_documents("profiles"), _from_file(load_profile, "p.toml")),
    "record": lambda: Parser((sample_record(),), lambda folder: rig_of_content),
    "recording": lambda: Parser((sample_recording(),), _from_file(read_recording, "r.ocrec")),
    "reference": lambda: Parser(_documents("references"), _from_file(load_reference, "r.toml")),
    "rig": lambda: Parser(_documents("rigs"), _from_file(load_rig, "rig.toml")),
    "table": lambda: Parser((_TABLE,), _from_file(feature_table, "table.csv")),
}
"""By name; samples are made on request."""

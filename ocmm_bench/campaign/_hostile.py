"""Hostile files given to the real commands: one trial per kind of file.

Files are grouped with the commands that read them. Hostile models (ISO 10303-21) are those that
typically crash C++ readers.
"""

from __future__ import annotations

import importlib.util
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from ocmm_bench.campaign._hostile_documents import (
    document_kinds,
    leaf_kinds,
    points_kinds,
    recording_kinds,
    table_kinds,
    writes,
)
from ocmm_bench.campaign._hostile_jobs import damaged_kinds, job_kinds
from ocmm_bench.campaign._hostile_runs import REFUSED, CommandResult, Forgery, run_aside, run_here
from ocmm_bench.campaign._kills import measure_job
from ocmm_bench.campaign._trials import NotRunError, Trial
from ocmm_bench.campaign._writers import other_station
from ocmm_core.documents import resource
from ocmm_core.storage import JobFile

_DAMAGED = 40
_GOOD = """
import sys
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
box = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), 100.0, 60.0, 20.0).Shape()
bore = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(20, 10, -1), gp_Dir(0, 0, 1)), 6.0, 30.0).Shape()
cone = BRepPrimAPI_MakeCone(gp_Ax2(gp_Pnt(60, 30, -1), gp_Dir(0, 0, 1)), 4.0, 9.0, 30.0).Shape()
writer = STEPControl_Writer()
writer.Transfer(BRepAlgoAPI_Cut(BRepAlgoAPI_Cut(box, bore).Shape(), cone).Shape(), STEPControl_AsIs)
writer.Write(sys.argv[1])
"""


def step_kinds(good: str, seed: int) -> list[Forgery]:
    """Return kinds of hostile models, made from the text of a good one with one solid."""
    head, data = good.split("DATA;", 1)
    body, end = data.rsplit("ENDSEC;", 1)
    last = max(int(number) for number in re.findall(r"#(\d+)", body))
    whole = {
        "nothing but its first word": "ISO-10303-21;",
        "no data": f"{head}DATA;\nENDSEC;{end}",
        "no end": f"{head}DATA;{body}",
        "no head": f"ISO-10303-21;\nDATA;{body}ENDSEC;{end}",
        "a schema that nobody has": good.replace("AUTOMOTIVE_DESIGN", "X" * 1000),
        "twice the same": good + good,
        "twice the same data": f"{head}DATA;{body}{body}ENDSEC;{end}",
        "brackets without end": f"{head}DATA;{body}#{last + 1}=X({'(' * 100_000});ENDSEC;{end}",
        "a text without end": f"{head}DATA;{body}#{last + 1}=X('{'x' * 100_000};ENDSEC;{end}",
        "a long text": good.replace("'Open CASCADE", "'" + "y" * 1_000_000, 1),
        "a remark without end": f"{head}DATA;{body}/* ENDSEC;{end}",
        "a number of 5000 digits": _numbers(good, "9" * 5000, 1),
        "all numbers huge": _numbers(good, "1.E300", -1),
        "all numbers tiny": _numbers(good, "1.E-300", -1),
        "all numbers nought": _numbers(good, "0.", -1),
        "all numbers -1": _numbers(good, "-1.", -1),
        "numbers that are none": _numbers(good, "NAN", -1),
        "every name is the first": re.sub(r"#\d+", "#1", good),
        "names that are too long": re.sub(r"#(\d+)", r"#99999999999999999999\1", good),
        "every reference is its own": re.sub(
            r"(#\d+) ?=([^;]*);", lambda m: f"{m[1]}={re.sub('#[0-9]+', m[1], m[2])};", good
        ),
        "every reference is the next": re.sub(
            r"\(([^;]*)\);",
            lambda m: "(" + re.sub(r"#(\d+)", lambda n: f"#{int(n[1]) + 1}", m[1]) + ");",
            good,
        ),
        "every entity is another": re.sub(r"= ?([A-Z_]+)\(", "=CARTESIAN_POINT(", good),
        "no name of a shape": good.replace("MANIFOLD_SOLID_BREP", "MANIFOLD_SOLID"),
        "no faces": good.replace("ADVANCED_FACE", "ADVANCED_FICE"),
        "100,000 more points": _more(
            head, body, end, last, "CARTESIAN_POINT('',(1.,2.,3.))", 100_000
        ),
        "a chain of 100,000": f"{head}DATA;{body}{_chain(last, 100_000)}ENDSEC;{end}",
        "units of nothing": re.sub(r"LENGTH_UNIT\(\)", "LENGTH_UNIT($)", good),
        "units in light years": good.replace(".MILLI.,.METRE.", ".EXA.,.METRE."),
        "markup in names": good.replace("'", "'<b>[/12]", 40),
        "control codes": good.replace("'", "'\x1b[2J", 40),
    }
    # Only a name, a remark, or one of several is odd in these.
    harmless = {
        "a long text", "markup in names", "control codes", "100,000 more points",
        "a chain of 100,000", "units in light years", "a schema that nobody has", "no head",
        "twice the same", "twice the same data", "units of nothing", "all numbers -1",
    }  # fmt: skip
    kinds = [Forgery(name, writes(text.encode()), name in harmless) for name, text in whole.items()]
    raw = {
        "no UTF-8": good.replace("'", "'\udcff\udcc3", 40).encode("utf-8", "surrogateescape"),
        "noughts behind it": good.encode() + bytes(1_000_000),
        "noughts within": good.encode()[:3000] + bytes(1000) + good.encode()[3000:],
        "UTF-16": b"ISO-10303-21;" + good.encode("utf-16"),
    }
    kinds += [Forgery(name, writes(content), harmless=True) for name, content in raw.items()]
    for number in range(_DAMAGED):
        content = _damaged(good, random.Random(f"{seed} {number}"))  # noqa: S311 - no secret
        kinds.append(Forgery(f"damaged {number}", writes(content), harmless=True))
    return kinds


def _numbers(text: str, instead: str, most: int) -> str:
    """Replace reals of the data; -1 is all of them."""
    return re.sub(r"(?<=[(,])-?\d+\.\d*(?:E[+-]?\d+)?(?=[,)])", instead, text, count=max(most, 0))


def _more(head: str, body: str, end: str, last: int, entity: str, n: int) -> str:
    added = "".join(f"#{last + number}={entity};\n" for number in range(1, n + 1))
    return f"{head}DATA;{body}{added}ENDSEC;{end}"


def _chain(last: int, n: int) -> str:
    """Return a cyclic assembly: each product is part of the next, the last of the first."""
    return "".join(
        f"#{last + 1 + at}=SHAPE_REPRESENTATION('',(#{last + 1 + (at + 1) % n}),$);\n"
        for at in range(n)
    )


def _damaged(good: str, chance: random.Random) -> bytes:
    """Return a model with some bytes changed, most of them in its data."""
    content = bytearray(good.encode())
    for _ in range(chance.choice((1, 2, 5, 20))):
        at = chance.randrange(len(content))
        way = chance.randrange(4)
        if way == 0:
            content[at] = chance.randrange(256)
        elif way == 1:
            del content[at : at + chance.randrange(200)]
        elif way == 2:
            content[at:at] = content[at : at + chance.randrange(200)]
        else:
            digits = re.compile(rb"\d+").search(content, at)
            if digits:
                content[digits.start() : digits.end()] = b"%d" % chance.randrange(400)
    return bytes(content)


Command = Callable[[Path, Path], list[str]]
"""Arguments for a file, and an output folder."""


@dataclass(frozen=True, slots=True)
class Group:
    """Kinds of files and the command that reads them."""

    word: str
    kinds: Sequence[Forgery]
    name: str
    command: Command
    good: Path


def good_files(folder: Path) -> dict[str, Path]:
    """Return good files by their word, with all code loaded and compiled."""
    # Warm up first, so that nothing is compiled during the trials.
    measure_job(folder / "warm", None)
    measure_job(folder / "measured", None)
    good = {"job": folder / "good.ocmm", "recording": folder / "good.ocrec"}
    good |= {"points": folder / "good.txt", "table": folder / "good.csv"}
    good["points"].write_text("0 0 0\n1 0 0\n0 1 0\n1 1 0.01\n", "utf-8")
    good["table"].write_text("name,shape,x,y,z,diameter\nS1,Sphere,0,0,0,20\n", "utf-8")
    if importlib.util.find_spec("OCP") is not None:
        good["step"] = folder / "good.step"
        command = [sys.executable, "-c", _GOOD, str(good["step"])]
        subprocess.run(command, check=True, capture_output=True)  # noqa: S603 - the text above
    next((folder / "measured").glob("*.ocmm")).rename(good["job"])
    with JobFile.open(good["job"]) as job:
        if not job.points():
            raise NotRunError("the computer is too busy: a good job has no points")
    quick, out = str(resource("plans", "quick.toml")), str(folder / "good-out")
    for arguments in (
        ["record", "--plan", quick, "--seconds", "0.5", "--out", str(good["recording"])],
        ["report", str(good["job"]), "--format", "json", "--incomplete", "--out", out],
        ["plan", "check", quick],
    ):
        run_here(arguments)
    return good


def hostile_groups(good: dict[str, Path], damaged: int, leaves: int, seed: int) -> list[Group]:
    quick = str(resource("plans", "quick.toml"))

    def recorded(option: str) -> Command:
        plan = [] if option == "--plan" else ["--plan", quick]
        return lambda file, out: [
            "record", option, str(file), *plan, "--seconds", "0.1", "--out", str(out / "x.ocrec")
        ]  # fmt: skip

    def report(file: Path, out: Path) -> list[str]:
        return ["report", str(file), "--format", "json", "--incomplete", "--out", str(out)]

    def imported(file: Path, out: Path) -> list[str]:
        return ["plan", "import", str(file), "--output", str(out / "plan.toml")]

    def profiled(file: Path, out: Path) -> list[str]:
        job = str(good["job"])
        return ["report", job, "--profile", str(file), "--incomplete", "--out", str(out)]

    def replayed(file: Path, out: Path) -> list[str]:
        source = ["--source", f"replay:{file}", "--uncalibrated"]
        return ["measure", "--plan", quick, *source, "--incomplete", "--out", str(out)]

    documents = {
        "plan": (resource("plans", "demo.toml"), lambda file, out: ["plan", "check", str(file)]),
        "rig": (resource("rigs", "recommended.toml"), recorded("--rig")),
        "probe": (resource("probes", "standard.toml"), recorded("--probe")),
        "part": (resource("parts", "demo.toml"), recorded("--part")),
        "reference": (next(resource("references").glob("*.toml")), recorded("--reference")),
        "profile": (resource("profiles", "polyworks.toml"), profiled),
    }
    found = [
        Group("job", job_kinds(), "J.ocmm", report, good["job"]),
        Group("damaged job", damaged_kinds(damaged, seed), "J.ocmm", report, good["job"]),
        Group(
            "recording", recording_kinds(good["recording"].read_bytes()), "R.ocrec", replayed,
            good["recording"],
        ),
        Group(
            "points", points_kinds(), "p.txt",
            lambda file, out: ["fit", str(file), "--shape", "plane"],
            good["points"],
        ),
        Group(
            "table", table_kinds(), "t.csv", imported, good["table"],
        ),
    ]  # fmt: skip
    # Models need an optional dependency.
    if "step" in good:
        kinds = step_kinds(good["step"].read_text("utf-8"), seed)
        found.append(Group("step", kinds, "m.step", imported, good["step"]))
    for word, (file, command) in documents.items():
        kinds = document_kinds(word, file.read_text("utf-8"), leaves, seed)
        found.append(Group(word, kinds, f"{word}.toml", command, file))

    def measured(option: str) -> Command:
        plan = [] if option == "--plan" else ["--plan", quick]
        return lambda file, out: [
            "measure", *plan, option, str(file), "--incomplete", "--out", str(out)
        ]  # fmt: skip

    # Accepted files must not fail later either: those with a replaced value are measured.
    for word, file in {
        "plan": resource("plans", "quick.toml"), "rig": documents["rig"][0],
        "probe": documents["probe"][0], "part": documents["part"][0],
    }.items():  # fmt: skip
        # A whole job takes a quarter of a minute.
        kinds = leaf_kinds(word, file.read_text("utf-8"), leaves // 4, seed + 1)
        found.append(Group(f"{word} in use", kinds, f"{word}.toml", measured(f"--{word}"), file))
    return found


def given(group: Group, kind: Forgery, folder: Path, index: int) -> CommandResult:
    """Make a file and give it to its command, in a separate process."""
    place = folder / f"{group.word}-{index}".replace(" ", "-")
    out = place / "out"
    out.mkdir(parents=True)
    file = place / group.name
    kind.make(folder / "good.ocmm", file)
    try:
        return run_aside(group.command(file, out), place / "words.txt")
    finally:
        shutil.rmtree(place, ignore_errors=True)


def usual_of(group: Group, folder: Path) -> float:
    """Return the CPU time of the good file of a group, s."""
    made = Forgery("good", lambda _, path: shutil.copyfile(group.good, path))
    return given(group, made, folder, -1).cpu_s


DAMAGED, LEAVES = 600, 40
"""Jobs with random damage, and documents of each kind with one value replaced."""
_FINDINGS = {
    "traceback": "tracebacks", "hang": "hangs above 5 s", "memory": "above 512 MB",
    "accepted": "wrongly used", "no sentence": "without a sentence",
}  # fmt: skip


def hostile(seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Yield the reaction to each kind of file, in random order; refusals count as acknowledged."""
    with tempfile.TemporaryDirectory(prefix="ocmm-hostile-") as name, quiet():
        folder = Path(name)
        with other_station(folder):
            groups = hostile_groups(good_files(folder), DAMAGED, LEAVES, seed)
            usual: dict[str, float] = {}
            for number, (group, kind) in enumerate(_drawn(groups, seed)[:runs]):
                if number in done:
                    continue
                if group.word not in usual:
                    usual[group.word] = usual_of(group, folder)
                answer = given(group, kind, folder, number)
                yield _trial(seed, number, kind, answer, answer.fault(kind, usual[group.word]))


def _drawn(groups: list[Group], seed: int) -> list[tuple[Group, Forgery]]:
    """Return all kinds, shuffled, so that a short run samples each group."""
    every = [(group, kind) for group in groups for kind in group.kinds]
    random.Random(seed).shuffle(every)  # noqa: S311 - an order, no secret
    return every


def _trial(seed: int, number: int, kind: Forgery, answer: CommandResult, fault: str) -> Trial:
    refused = int(answer.code == REFUSED and not fault)
    if not fault:
        return Trial("hostile", seed, number, refused, {})
    note = (
        f"{kind.name}: exit {answer.code}, {answer.cpu_s:.1f} s, {answer.memory_mb:.0f} MB: "
        f"{' '.join(answer.words.split())[:300]}"
    )
    return Trial("hostile", seed, number, refused, {_FINDINGS[fault]: 1}, note)


@contextmanager
def quiet() -> Iterator[None]:
    """Discard the output of the commands that make the good files."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)

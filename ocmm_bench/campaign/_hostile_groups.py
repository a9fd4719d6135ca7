"""Groups of hostile files and the commands that read them."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ocmm_bench.campaign._hostile_documents import (
    document_kinds,
    leaf_kinds,
    points_kinds,
    recording_kinds,
    table_kinds,
)
from ocmm_bench.campaign._hostile_forge import Forgery
from ocmm_bench.campaign._hostile_jobs import damaged_kinds, job_kinds
from ocmm_bench.campaign._hostile_runs import CommandResult, run_aside, run_here
from ocmm_bench.campaign._hostile_steps import has_models, step_kinds, write_good_step
from ocmm_bench.campaign._kills import measure_job
from ocmm_bench.campaign._trials import NotRunError
from ocmm_core.documents import resource
from ocmm_core.storage import JobFile

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
    if has_models():
        good["step"] = folder / "good.step"
        write_good_step(good["step"])
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
        def command(file: Path, out: Path) -> list[str]:
            plan = [] if option == "--plan" else ["--plan", quick]
            to = str(out / "x.ocrec")
            return ["record", option, str(file), *plan, "--seconds", "0.1", "--out", to]

        return command

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
        def command(file: Path, out: Path) -> list[str]:
            plan = [] if option == "--plan" else ["--plan", quick]
            return ["measure", *plan, option, str(file), "--incomplete", "--out", str(out)]

        return command

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
    return given(group, Forgery("good", partial(_copy, group.good)), folder, -1).cpu_s


def _copy(file: Path, good: Path, path: Path) -> None:
    shutil.copyfile(file, path)

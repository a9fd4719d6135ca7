"""Commands print on terminals of any encoding, and report files only after they were written."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from tests.host import HANG_S, long_form

ENCODINGS = {"latin-1": "Ø", "cp850": "Ø", "ascii": "O"}
"""A sign that two of them have; none has a Chinese one."""


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a finished job."""
    folder = tmp_path_factory.mktemp("encodings")
    request = StationRequest(plan=resource("plans", "quick.toml"), out=folder, frame_rate_hz=500)
    built = build_station(request)
    try:
        built.station.start()
        assert built.station.wait_finished(HANG_S)
    finally:
        built.station.close()
    return built.job_path


_ALL = """
import contextlib, io, os, sys
from ocmm_cli import _entry
job, folder = sys.argv[1:3]
points = os.path.join(folder, "points Ø 中.csv")
if not os.path.exists(points):
    with open(points, "w") as stream:
        stream.write("# unit: mm\\nx,y,z\\n0,0,0\\n10,0,0.01\\n0,10,0\\n10,10,0.02\\n5,5,0\\n")
fit = ["fit", "--shape", "plane"]
some = sys.argv[3] == "some"
for arguments in (
    [*fit, points], ["uncertainty", job], ["align", job], ["recall", job], ["compare", job],
    ["audit", "verify", job], ["environment", job], ["report", "--help"], ["calibrate", "status"],
    ["probe", "uncertainty"], [*fit, points + ".gone"], ["--language", "de", "uncertainty", job],
    ["--language", "de", *fit, points], ["--language", "de", "measure", "--help"],
)[:: 6 if some else 1]:
    sys.argv = ["ocmm", *arguments]
    code = 0
    try:
        _entry.main()
    except SystemExit as end:
        code = end.code or 0
    print("CODE", code, *arguments)
"""


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_command_that_prints_tables_prints_them(
    encoding: str, job: Path, tmp_path: Path
) -> None:
    extent = "all" if encoding == "ascii" else "some"
    done = subprocess.run(
        [sys.executable, "-c", _ALL, str(job), str(tmp_path), extent],
        capture_output=True, timeout=HANG_S, check=False, cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": encoding},
    )  # fmt: skip
    out = done.stdout.decode(encoding)
    error = done.stderr.decode(encoding)
    assert done.returncode == 0, error
    codes = [line.split()[1] for line in out.splitlines() if line.startswith("CODE")]
    assert len(codes) == (14 if extent == "all" else 3)
    # 3 is a failure of the program.
    assert "3" not in codes, error
    assert "UnicodeEncodeError" not in error
    assert "All points taken" not in error
    assert f"points {ENCODINGS[encoding]} \\u4e2d.csv" in out


_WALK = """
import io, os, sys
import typer
from ocmm_cli import _entry
from ocmm_cli._app import app

ENCODINGS = ("latin-1", "cp850", "ascii", "cp1252", "utf-8")
# They run for long, or start a window, a bus or the compiler; their help is printed all the same.
LONG = {
    "bench", "compile", "demo", "measure", "window", "rig up", "rig down", "rig status",
    "selftest reliability", "study coverage", "study probe-calibration", "station doctor",
    "acceptance run", "acceptance plan", "calibrate cameras", "calibrate check-tip",
    "calibrate mount-tip", "calibrate probe", "calibrate relocate", "calibrate sensors",
    "calibrate tip", "calibrate verify", "probe design", "record", "verify-fits",
    "support bundle", "camera conform", "key replace", "key restored", "serve ippdme",
    "serve keyboard", "serve lines", "serve mqtt", "serve opcua", "serve screen",
}
ODD = "Gr\\u00f6\\u00dfe \\u00d8 \\u4e2d"
plan, every = sys.argv[1], sys.argv[2] == "every"
out, error = sys.stdout, sys.stderr

def leaves(command, path=()):
    for name, one in sorted(getattr(command, "commands", {}).items()):
        yield from leaves(one, (*path, name))
    if not hasattr(command, "commands"):
        yield path, command

def filled(command):
    for one in command.params:
        if one.required:
            word = "1" if one.name in ("value", "address", "u_cal") else ODD
            yield from (word,) if one.param_type_name == "argument" else (one.opts[0], word)

runs = [["plan", "check", plan], ["fit", plan, "--shape", "plane"], ["settings", "show"],
        ["plan", "import", plan, "-o", plan + ".toml"]]
for path, command in leaves(typer.main.get_command(app)):
    if path == ("window",):
        # Its process becomes that of the window.
        continue
    runs.append([*path, "--help"])
    if " ".join(path) not in LONG:
        runs.append([*path, *filled(command)])
failed = 0
for number, arguments in enumerate(runs if every else runs[::18]):
    for encoding in ENCODINGS if every else (ENCODINGS[number % len(ENCODINGS)],):
        sys.argv = ["ocmm", "--language", ("de", "en")[number % 2], *arguments]
        sys.stdout = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
        sys.stderr = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
        code = 0
        try:
            _entry.main()
        except SystemExit as end:
            code = end.code or 0
        except BaseException as end:
            code = repr(end)
        told = ""
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
            told += stream.buffer.getvalue().decode(encoding)
        untrue = [word for word in ("UnicodeEncodeError", "points taken", "Open the job again",
                                    "Aufgenommene Punkte", "Auftrag wieder") if word in told]
        if code not in (0, 1, 2, 130) or (untrue and arguments[-1] != "--help"):
            failed += 1
            print(encoding, code, untrue, arguments, told[-400:], file=out)
print("WALKED", len(runs), "FAILED", failed, file=out)
"""


@pytest.mark.slow
def test_every_command_prints_in_every_encoding(tmp_path: Path) -> None:
    """Help and a run of each command, in both languages.

    Each in every encoding in the long form; every 18th in one of them otherwise.
    """
    plan = tmp_path / "Größe Ø 中.toml"
    text = resource("plans", "quick.toml").read_text().replace('"SPHERE"', '"KUGEL Ø 中"')
    plan.write_text(text.replace("nominal = 20.34", "nominal = 21.34"), encoding="utf-8")
    home = {name: str(tmp_path) for name in ("HOME", "XDG_STATE_HOME", "XDG_DATA_HOME",
                                             "XDG_CONFIG_HOME", "XDG_CACHE_HOME")}  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", _WALK, str(plan), "every" if long_form() else "one"],
        capture_output=True, timeout=10 * HANG_S, check=False, cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        env={**os.environ, **home, "LANG": "C", "PYTHONIOENCODING": "utf-8"},
    )  # fmt: skip
    out = done.stdout.decode()
    assert done.returncode == 0, done.stderr.decode()
    walked = out.splitlines()[-1].split()
    assert int(walked[1]) > 150
    assert walked[3] == "0", out
    if long_form():
        done = subprocess.run(
            [sys.executable, "-m", "ocmm_cli", "window", "--help"],
            capture_output=True, timeout=HANG_S, check=False, cwd=tmp_path,
            env={**os.environ, **home, "PYTHONIOENCODING": "ascii"},
        )  # fmt: skip
        assert done.returncode == 0, done.stderr.decode()
        assert "degC" in done.stdout.decode("ascii")

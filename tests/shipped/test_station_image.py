"""The recipe of a station's image holds together; installer/station/try.sh starts the image."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

from installer.locks import ROOT
from ocmm_core.doctor import Computer, Light, examine
from tests.host import HANG_S

STATION = ROOT / "installer" / "station"
TREE = STATION / "root"
UNITS = TREE / "usr/lib/systemd/system"
CORE = "3"


def read(name: str) -> str:
    return (STATION / name).read_text(encoding="utf-8")


def scripts() -> list[Path]:
    return sorted(
        path for path in STATION.rglob("*")
        if path.is_file() and path.read_bytes().startswith(b"#!/bin/sh")
    )  # fmt: skip


def arguments() -> dict[str, str]:
    """Return the kernel's arguments of a station whose bus has processor 3, as it is built."""
    fill = re.search(r'^sed "s/@CORE@.*"(?= "\$here/arguments.cfg")', read("build.sh"), re.M)
    assert fill is not None
    text = subprocess.run(
        ["sh", "-c", f"core={CORE}; {fill[0]} arguments.cfg"],
        cwd=STATION, check=True, capture_output=True, text=True, timeout=HANG_S,
    ).stdout  # fmt: skip
    said = " ".join(re.findall(r'^set arguments="(?:\$arguments )?(.*)"$', text, re.M))
    return dict(word.partition("=")[::2] for word in said.split())


def test_the_scripts_are_there() -> None:
    names = {path.name for path in scripts()}
    assert {
        "build.sh",
        "try.sh",
        "inside.sh",
        "station-update",
        "technician",
        "tune",
        "window",
    } <= names


@pytest.mark.parametrize("script", scripts(), ids=lambda path: path.relative_to(STATION).as_posix())
def test_a_shell_can_read_every_script(script: Path) -> None:
    subprocess.run(["sh", "-n", str(script)], check=True, timeout=HANG_S)
    if script.parent.name != "try":
        assert os.access(script, os.X_OK)


def test_units_are_enabled_and_start_what_is_there() -> None:
    enabled = set(re.findall(r"[\w@.-]+\.(?:service|socket)", read("inside.sh")))
    units = sorted(UNITS.glob("*.service"))
    assert len(units) >= 4
    for unit in units:
        assert unit.name in enabled
        text = unit.read_text(encoding="utf-8")
        started = re.findall(r"/usr/lib/ocmm-station/[\w.-]+", text)
        if not started:
            assert "ExecStart=/usr/bin/ocmm " in text
        for program in started:
            assert os.access(TREE / program.lstrip("/"), os.X_OK), program
    assert "ocmm-acq.socket" in enabled
    assert (ROOT / "installer/linux/ocmm-acq.socket").is_file()


def test_one_processor_belongs_to_the_bus() -> None:
    given = arguments()
    assert given["isolcpus"].split(",")[-1] == CORE
    assert "domain" in given["isolcpus"]
    assert given["nohz_full"] == given["rcu_nocbs"] == CORE
    assert given["irqaffinity"] == "0-2"


def test_what_the_kernel_is_told_makes_the_doctor_content(tmp_path: Path) -> None:
    """The kernel's files as it makes them from these arguments, and the service as it is built."""
    given = arguments()
    cpu = tmp_path / "sys/devices/system/cpu"
    cpu.mkdir(parents=True)
    for name, text in (
        ("online", "0-3"),
        ("isolated", given["isolcpus"].split(",")[-1]),
        ("nohz_full", given["nohz_full"]),
    ):
        (cpu / name).write_text(f"{text}\n", encoding="ascii")
    for number in range(4):
        folder = cpu / f"cpu{number}/cpufreq"
        folder.mkdir(parents=True)
        governor = given["cpufreq.default_governor"]
        (folder / "scaling_governor").write_text(f"{governor}\n", encoding="ascii")
    system = tmp_path / "usr/lib/systemd/system"
    system.mkdir(parents=True)
    for name in ("ocmm-acq@.service", "ocmm-acq.socket"):
        (system / name).write_bytes((ROOT / "installer/linux" / name).read_bytes())
    written = re.search(r"printf '(\[Service\].*?)' \"\$core\" >\"(\S+)\"", read("inside.sh"))
    assert written is not None
    drop_in = tmp_path / written[2].lstrip("/")
    drop_in.parent.mkdir(parents=True)
    drop_in.write_text(written[1].replace("\\n", "\n").replace("%s", CORE), encoding="ascii")

    computer = Computer(
        root=tmp_path, user="inspector", uid=1000, by_sudo=False, home=Path("/home/inspector"),
        data=Path("/home/inspector/data"), state=Path("/home/inspector/state"),
        jobs=Path("/home/inspector"), program=Path("/opt/ocmm/ocmm"),
    )  # fmt: skip
    report, _changes = examine(computer)
    lights = {one.name: one.light for one in report.results}
    for name in ("cores", "governor", "memory"):
        assert lights[name] is Light.GREEN


def test_the_data_partition_is_mounted_alike_by_both() -> None:
    script = read("root/usr/share/initramfs-tools/scripts/init-bottom/ocmm-station")
    early = re.search(r"mount -t ext4 -o (\S+) \"\$device\" \"\$data\"", script)
    assert early is not None
    line = next(one.split() for one in read("root/etc/fstab").splitlines() if "LABEL=" in one)
    assert line[:3] == ["LABEL=ocmm-data", "/data", "ext4"]
    assert [one for one in line[3].split(",") if not one.startswith("x-")] == early[1].split(",")
    # A point is on the disk when fsync returns; these options would give that up.
    assert not {"nobarrier", "barrier=0", "data=writeback"} & set(early[1].split(","))


def test_the_places_on_the_disk_are_the_same_everywhere() -> None:
    build = read("build.sh")
    table = {
        name: (int(start), int(size))
        for start, size, name in re.findall(
            r"^start=(\d+)MiB,\s+size=(\d+)MiB,.*name=ocmm-(\w+)$", build, re.M
        )
    }
    assert table.keys() == {"boot", "a", "b", "data"}
    assert table["a"][1] == table["b"][1]
    end = 1
    for start, size in table.values():
        assert start == end
        end += size
    placed = re.findall(r'^place "\$work/(\w+)\.\w+" (\d+)$', build, re.M)
    assert dict(placed) == {
        "esp": str(table["boot"][0]), "system": str(table["a"][0]), "data": str(table["data"][0]),
    }  # fmt: skip
    update = read("root/usr/sbin/station-update")
    assert f"bs=1M skip={table['a'][0]} count={table['a'][1]} " in update
    assert f"-i $(({table['a'][0]} << 20)):0 -n $(({table['a'][1]} << 20))" in update
    assert f'"$image@@{table["boot"][0]}M"' in update
    assert f"disk.img?offset=$(({table['data'][0]} << 20))" in read("try.sh")


def test_nobody_gets_in_without_a_password() -> None:
    inside = read("inside.sh")
    assert "passwd --lock root" in inside
    assert "--shell /usr/sbin/nologin" in inside.split("inspector\n")[0]
    assert "NOPASSWD" not in "".join(path.read_text(encoding="utf-8") for path in scripts())
    # No way to change the kernel's line, no shell before the system is there, none by network.
    assert "set superusers=nobody" in read("grub.cfg")
    assert read("grub.cfg").count("--unrestricted") == read("grub.cfg").count("menuentry ")
    assert int(arguments()["panic"]) > 0
    assert not re.search(r"ssh|telnet|vnc", read("build.sh"))
    # The image does not contain its tests.
    assert not list(TREE.rglob("try*"))

"""Compare what masters that nobody here wrote see of the cameras with the ESI file.

Run inside a network namespace: ``python benchmarks/esi_agreement.py RESULT.json MASTER``; writes
the list of differences, which is empty in good order.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from xml.etree import ElementTree

import msgspec

from benchmarks.fault_rig import HOST, FaultRig
from benchmarks.second_master import NOT_STARTED, FoundCamera, Mapped
from ocmm_core.documents import resource, write_atomic
from ocmm_core.fieldbus.device import CameraIdentity

CAMERAS = (CameraIdentity("left", 1001, 1), CameraIdentity("right", 1002, 2))
_PROGRAM = Path(__file__).with_name("second_master.py")
_TRIES = 6
_PATIENCE_S = 100.0


def number(text: str | None) -> int:
    """Return a number of an ESI file, ``#x...`` or decimal."""
    text = text or "0"
    return int(text[2:], 16) if text.startswith("#x") else int(text)


def differences(found: FoundCamera) -> list[str]:
    """Return what differs between a camera and the ESI file."""
    root = ElementTree.fromstring(resource("ethercat", "ocmm_camera.xml").read_bytes())  # noqa: S314 - our own file
    device = root.find("Descriptions/Devices/Device")
    kind = None if device is None else device.find("Type")
    if device is None or kind is None:
        return ["the ESI file describes no device"]
    told = {
        "vendor": (found.vendor, number(root.findtext("Vendor/Id"))),
        "product": (found.product, number(kind.get("ProductCode"))),
        "revision": (found.revision, number(kind.get("RevisionNo"))),
        "name": (found.name, kind.text),
        "outputs": (_shape(found.outputs), _described(device, "RxPdo", "2")),
        "inputs": (_shape(found.inputs), _described(device, "TxPdo", "3")),
        "bytes of outputs": (found.output_bytes, _size(device, "Outputs")),
        "bytes of inputs": (found.input_bytes, _size(device, "Inputs")),
        "state": (found.state, "OPERATIONAL"),
    }
    wrong = [f"{what}: {seen}, ESI: {esi}" for what, (seen, esi) in told.items() if seen != esi]
    names = _names(device)
    for mapped in (m for pdo in (*found.outputs.values(), *found.inputs.values()) for m in pdo):
        if mapped.name and names[mapped.index, mapped.sub] != mapped.name:
            wrong.append(f"name of {mapped.index:#06x}:{mapped.sub:02x}: {mapped.name}")
    return wrong


def _shape(pdos: dict[int, tuple[Mapped, ...]]) -> dict[int, list[tuple[int, int, int]]]:
    return {index: [(m.index, m.sub, m.bits) for m in pdo] for index, pdo in pdos.items()}


def _described(
    device: ElementTree.Element, tag: str, sync_manager: str
) -> dict[int, list[tuple[int, int, int]]]:
    """Return the mapping of the PDOs that belong to a sync manager."""
    return {
        number(pdo.findtext("Index")): [
            (
                number(entry.findtext("Index")),
                number(entry.findtext("SubIndex")),
                number(entry.findtext("BitLen")),
            )
            for entry in pdo.findall("Entry")
        ]
        for pdo in device.findall(tag)
        if pdo.get("Sm") == sync_manager
    }


def _names(device: ElementTree.Element) -> dict[tuple[int, int], str]:
    return {
        (number(entry.findtext("Index")), number(entry.findtext("SubIndex"))):
            entry.findtext("Name") or ""
        for tag in ("RxPdo", "TxPdo")
        for entry in device.findall(f"{tag}/Entry")
    }  # fmt: skip


def _size(device: ElementTree.Element, name: str) -> int:
    return sum(number(sm.get("DefaultSize")) for sm in device.findall("Sm") if sm.text == name)


def compare(master: str) -> list[str]:
    """Let a master bring the cameras to operation and return what differs from the ESI file."""
    with tempfile.TemporaryDirectory() as folder, FaultRig(Path(folder), CAMERAS):
        faults: list[str] = []
        # The time limits of other masters are fixed and short for a busy computer.
        for _ in range(_TRIES):
            done = subprocess.run(  # noqa: S603 - our own interpreter and program, no shell
                [sys.executable, str(_PROGRAM), master, HOST],
                capture_output=True,
                text=True,
                timeout=_PATIENCE_S,
                check=False,
            )
            if done.returncode == 0:
                break
            faults.append(done.stderr.strip().splitlines()[-1] if done.stderr else "no cameras")
    if done.returncode:
        # The error of an attempt that got past the start describes the cameras better.
        return [next((fault for fault in faults if NOT_STARTED not in fault), faults[-1])]
    found = msgspec.json.decode(done.stdout.splitlines()[-1], type=list[FoundCamera])
    wrong = [difference for camera in found for difference in differences(camera)]
    if [camera.serial for camera in found] != [camera.serial for camera in CAMERAS]:
        wrong.append(f"serial numbers: {[camera.serial for camera in found]}")
    return wrong


if __name__ == "__main__":
    write_atomic(Path(sys.argv[1]), msgspec.json.encode(compare(sys.argv[2])))

"""Write the bill of materials of OCMM: what it consists of, under which licences.

``./run sbom [FILE]`` writes a CycloneDX document (1.6, JSON), to standard output without a file.
It holds what `requirements.lock` installs and, as optional, what `requirements-step.lock` adds;
what only develops and tests is not part of the product. Nothing is asked of a network, and the
same lock files give the same document, byte for byte: its serial number follows from its content,
its date is SOURCE_DATE_EPOCH (seconds since 1970) or left out.
"""

from __future__ import annotations

import json
import os
import sys
import uuid
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentScope, ComponentType
from cyclonedx.model.license import LicenseExpression
from cyclonedx.output.json import JsonV1Dot6
from packageurl import PackageURL

from installer.licences import licences, surprise
from installer.locks import RUNTIME, STEP, Pin, read_lock
from ocmm_core import __version__
from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError, OcmmError

_OURS = uuid.UUID("b424db60-2708-4351-a363-d4cea0be5139")
"""Names the space of the serial numbers; drawn once."""
_INSTALLS_ONLY = {"setuptools"}
"""Put in place by the set-up, and not used afterwards."""


def bill_of_materials(date: datetime | None = None) -> bytes:
    """Return the bill of materials as JSON.

    Parameters
    ----------
    date
        When it was made; left out by default.

    Raises
    ------
    InputError
        A lock file cannot be read, or a package's licence is not stated.
    """
    runtime = read_lock(RUNTIME)
    pins = runtime | read_lock(STEP)
    ours = Component(
        name="ocmm",
        version=__version__,
        type=ComponentType.APPLICATION,
        bom_ref=f"ocmm@{__version__}",
        licenses=[LicenseExpression("MIT")],
    )
    parts = {name: _component(pin, name in runtime) for name, pin in pins.items()}
    bom = Bom(components=parts.values())
    bom.metadata.component = ours
    for name, part in (("", ours), *parts.items()):
        bom.register_dependency(
            part, [parts[pin.name] for pin in pins.values() if name in pin.needed_by]
        )
    content = json.loads(JsonV1Dot6(bom).output_as_string())
    # The library gives both from chance and from the clock.
    del content["serialNumber"], content["metadata"]["timestamp"]
    if date is not None:
        content["metadata"]["timestamp"] = date.astimezone(UTC).isoformat()
    content["serialNumber"] = uuid.uuid5(_OURS, _text(content)).urn
    return _text(content).encode("utf-8")


def main(arguments: list[str]) -> None:
    """Write the bill of materials to the file named, or to standard output.

    Raises
    ------
    InputError
        What is installed is not what the lock files and `licences.toml` say.
    """
    for name, pin in (read_lock(RUNTIME) | read_lock(STEP)).items():
        if found := surprise(name, pin.version):
            raise InputError(
                "sbom.installed",
                f"{name}: {found}.",
                "Run ./run setup; correct installer/licences.toml if its licence has changed.",
            )
    content = bill_of_materials(_date(os.environ.get("SOURCE_DATE_EPOCH", "")))
    if arguments:
        write_atomic(Path(arguments[0]), content)
    else:
        sys.stdout.buffer.write(content)


def _component(pin: Pin, is_runtime: bool) -> Component:
    known = licences().packages.get(pin.name)
    if known is None:
        raise InputError(
            "sbom.licence",
            f"No licence of {pin.name} is stated.",
            "Add it to installer/licences.toml.",
        )
    purl = PackageURL(type="pypi", name=pin.name, version=pin.version)
    scope = ComponentScope.REQUIRED if is_runtime else ComponentScope.OPTIONAL
    return Component(
        name=pin.name,
        version=pin.version,
        type=ComponentType.LIBRARY,
        bom_ref=str(purl),
        purl=purl,
        scope=ComponentScope.EXCLUDED if pin.name in _INSTALLS_ONLY else scope,
        licenses=[LicenseExpression(known.licence)],
        hashes=[HashType(alg=HashAlgorithm.SHA_256, content=digits) for digits in pin.hashes],
        components=_inside(pin),
    )


def _inside(pin: Pin) -> Iterable[Component]:
    for part in licences().parts_of(pin.name):
        yield Component(
            name=part.name,
            type=ComponentType.LIBRARY,
            bom_ref=f"{pin.name}@{pin.version}#{part.name}",
            licenses=[LicenseExpression(part.licence)],
        )


def _date(seconds: str) -> datetime | None:
    if not seconds:
        return None
    try:
        return datetime.fromtimestamp(int(seconds), UTC)
    except (ValueError, OverflowError, OSError) as error:
        raise InputError(
            "sbom.date",
            f"SOURCE_DATE_EPOCH is {seconds!r}, which is no date.",
            "Give whole seconds since 1970, or leave it out.",
        ) from error


def _text(content: object) -> str:
    return json.dumps(content, indent=2, sort_keys=True, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except OcmmError as problem:
        sys.stderr.write(f"{problem}\n")
        sys.exit(2)

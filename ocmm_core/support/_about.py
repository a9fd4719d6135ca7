"""About this program: build, licences, and the places of its files."""

from __future__ import annotations

import platform
from collections.abc import Callable
from dataclasses import dataclass

from ocmm_core.build import this_build
from ocmm_core.manual import changes_since, shipped_text
from ocmm_core.support._parts import SupportSite


@dataclass(frozen=True, slots=True)
class AboutLine:
    title: str
    value: str


@dataclass(frozen=True, slots=True)
class AboutDocument:
    title: str
    text: Callable[[], str]


DOCUMENTS = (
    AboutDocument(title="Licence", text=lambda: shipped_text("LICENSE")),
    AboutDocument(
        title="Third-party licences", text=lambda: shipped_text("THIRD_PARTY_LICENCES.md")
    ),
    AboutDocument(title="Changes", text=lambda: "\n".join(changes_since())),
)
"""In the order of the page."""


def about_lines(site: SupportSite) -> tuple[AboutLine, ...]:
    """Return version, commit, licence and folders, for the page and for a message to support."""
    build, store = this_build(), site.store
    cameras, probes = site.records
    commit = (
        AboutLine(title="Commit", value=build.commit),
        AboutLine(title="Date of the commit", value=build.date),
        AboutLine(title="Sources", value="changed since" if build.changed else "as in the commit"),
    )
    return (
        AboutLine(title="Version", value=build.version),
        *(commit if build.commit else ()),
        AboutLine(title="Python", value=f"{platform.python_version()}, {platform.platform()}"),
        AboutLine(title="Licence", value="MIT"),
        AboutLine(title="Jobs", value=str(store.load().settings.job_folder.absolute())),
        AboutLine(title="Your settings", value=str(store.user.path)),
        AboutLine(title="Settings of the station", value=str(store.station.path)),
        AboutLine(title="Calibrations", value=str(cameras)),
        AboutLine(title="Probes", value=str(probes)),
        AboutLine(title="Logs", value=str(site.logs)),
    )

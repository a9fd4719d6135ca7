"""Hooks of MkDocs for the documentation site (`mkdocs.yml`).

Navigation follows the reading order of the manual. Each public package gets an API page. Links to
files outside `docs` become code: the site does not contain them.
"""

from __future__ import annotations

import re
from itertools import groupby
from pathlib import Path
from typing import Any

from ocmm_core.manual import ManualPart, load_manual

DOCS = Path(__file__).resolve().parent
FACES = (
    "ocmm_core.features", "ocmm_core.alignment", "ocmm_core.tables", "ocmm_core.geometry",
    "ocmm_core.camera", "ocmm_core.tracking", "ocmm_core.inspection.plan", "ocmm_core.errors",
)  # fmt: skip
_TITLES = {
    ManualPart.INSPECTOR: "Inspector", ManualPart.TECHNICIAN: "Technician",
    ManualPart.QUALITY: "Quality engineer", ManualPart.INTEGRATOR: "Integrator",
    ManualPart.DEVELOPER: "Developer", ManualPart.DECISIONS: "Decisions",
}  # fmt: skip
_GERMAN = {
    ManualPart.INSPECTOR: "Bediener", ManualPart.TECHNICIAN: "Wartung",
    ManualPart.QUALITY: "Qualität", ManualPart.INTEGRATOR: "Integration",
    ManualPart.DEVELOPER: "Entwicklung", ManualPart.DECISIONS: "Entscheidungen",
}  # fmt: skip
_LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^):#]+)(#[^)]*)?\)")


def _api(face: str) -> str:
    return f"api/{face.removeprefix('ocmm_core.').replace('.', '_')}.md"


def on_config(config: Any) -> Any:
    """Set the navigation: readers as tabs, then API and German pages."""
    nav: list[Any] = ["README.md"]
    for part, chapters in groupby(load_manual(DOCS).chapters, lambda one: one.part):
        if part in _TITLES:
            nav.append({_TITLES[part]: [one.name for one in chapters]})
    nav.append({"Python API": [{face: _api(face)} for face in FACES]})
    german = [one for one in load_manual(DOCS, "de").chapters if one.language == "de"]
    nav.append(
        {
            "Deutsch": [
                {_GERMAN[part]: [{one.title: f"de/{one.name}"} for one in chapters]}
                for part, chapters in groupby(german, lambda one: one.part)
                if part in _GERMAN
            ]
        }
    )
    config.nav = nav
    return config


def on_page_context(context: Any, *, page: Any, config: Any, **_others: Any) -> Any:
    """Show the buttons and hints of the theme in the language of the page."""
    config.theme["language"] = "de" if page.file.src_uri.startswith("de/") else "en"
    return context


def on_files(files: Any, config: Any) -> Any:
    """Add a page for each public package."""
    from mkdocs.structure.files import File

    for face in FACES:
        files.append(File.generated(config, _api(face), content=f"# {face}\n\n::: {face}\n"))
    return files


def _anchored(name: str, markdown: str) -> str:
    """Return a German page whose headings have the anchors of the English ones."""
    chapter = load_manual(DOCS, "de").chapter(name)
    anchors = iter([] if chapter is None else [one.anchor for one in chapter.sections])
    lines, fenced = [], False
    for line in markdown.split("\n"):
        fenced ^= line.lstrip().startswith("```")
        is_heading = not fenced and re.match(r"#{1,6} ", line)
        lines.append(f"{line} {{#{next(anchors)}}}" if is_heading else line)
    return "\n".join(lines)


def on_page_markdown(markdown: str, *, page: Any, **_others: Any) -> str:
    """Replace links to files outside `docs`, and fail if such a file is missing."""
    if page.file.src_uri.startswith("de/"):
        markdown = _anchored(page.file.src_uri.removeprefix("de/"), markdown)
    folder = (DOCS / page.file.src_uri).parent

    def replaced(found: re.Match[str]) -> str:
        target = (folder / found[2]).resolve()
        if target.is_relative_to(DOCS):
            return found[0]
        if not target.exists():
            message = f"{page.file.src_uri}: {found[2]} does not exist."
            raise FileNotFoundError(message)
        return f"{found[1]} (`{target.relative_to(DOCS.parent)}`)"

    return _LINK.sub(replaced, markdown)

"""What pyproject.toml cannot say: what is shipped beside the sources.

In a checkout `resources` stands at the top, in a wheel it is `ocmm_core/resources`. pyproject.toml
either finds the packages or lists them; here they are found, and this one is added under its other
name. `ocmm_core.documents.resource` looks for it in both places.

The manual is the documents of `docs` with their translations (`docs/de`) and the pictures that they
show, without the programs beside them; in a wheel it is `ocmm_core/resources/manual`
(`ocmm_core.manual.manual_folder`).
"""

import os
import re
import sys
from pathlib import Path

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

sys.path.insert(0, str(Path(__file__).resolve().parent))

from ocmm_core.build import this_build

_PICTURE = re.compile(r"!\[[^\]]*\]\(([^)\s]+)\)")


def manual_files(folder: Path) -> list[Path]:
    """Return the files of the manual: every document, and every picture that one of them shows."""
    documents = sorted(folder.rglob("*.md"))
    pictures = {
        # A translation shows those of the English document, from the folder above its own.
        Path(os.path.normpath(document.parent / name))
        for document in documents
        for name in _PICTURE.findall(document.read_text(encoding="utf-8"))
    }
    return [*documents, *sorted(one for one in pictures if one.is_file())]


def write_build(folder: Path) -> None:
    """Write the commit into a copy of the sources, whose `.git` it does not have."""
    path = folder / "ocmm_core/_build.txt"
    # In a source distribution it can be a hard link to the file of the checkout.
    path.unlink(missing_ok=True)
    path.write_text(f"{this_build().line()}\n", encoding="utf-8")


class SourcesWithBuild(sdist):
    """Names the commit in a source distribution."""

    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        """Copy the files, then write the commit."""
        super().make_release_tree(base_dir, files)
        write_build(Path(base_dir))


class BuildWithManual(build_py):
    """Adds the manual to the other resources, and the commit."""

    def run(self) -> None:
        """Build as usual, then add the manual and the commit."""
        super().run()
        # An editable installation reads the documents of the checkout.
        if getattr(self, "editable_mode", False):
            return
        docs = Path(__file__).resolve().parent / "docs"
        for path in manual_files(docs):
            target = Path(self.build_lib, "ocmm_core/resources/manual", path.relative_to(docs))
            self.mkpath(str(target.parent))
            self.copy_file(str(path), str(target))
        resources = Path(self.build_lib, "ocmm_core/resources")
        for name in ("CHANGELOG.md", "LICENSE", "THIRD_PARTY_LICENCES.md"):
            self.copy_file(str(docs.with_name(name)), str(resources))
        write_build(Path(self.build_lib))


if __name__ == "__main__":
    setup(
        version=this_build().version,
        packages=[*find_packages(include=["ocmm_*"]), "ocmm_core.resources"],
        package_dir={"ocmm_core.resources": "resources"},
        package_data={
            "": ["py.typed"],
            "ocmm_core": ["_build.txt"],
            "ocmm_core.resources": ["**/*"],
        },
        cmdclass={"build_py": BuildWithManual, "sdist": SourcesWithBuild},
    )

from __future__ import annotations

from collections.abc import Mapping

ENGLISH = "en"
LANGUAGES = (ENGLISH, "de")
"""In which the core speaks; the first is that of the sources."""

_VARIABLE = "OCMM_LANGUAGE"


def language_of(environment: Mapping[str, str], chosen: str = "") -> str:
    """Return the language: OCMM_LANGUAGE, else the setting ``chosen``, else the system's.

    Of the system's ``LC_ALL``, ``LC_MESSAGES`` and ``LANG`` in ``environment`` the first that is
    set counts, as everywhere (POSIX.1-2017, 8.2).
    """
    system = next(
        (found for name in ("LC_ALL", "LC_MESSAGES", "LANG") if (found := environment.get(name))),
        "",
    )
    for wanted in (environment.get(_VARIABLE, ""), chosen):
        if _short(wanted) in LANGUAGES:
            return _short(wanted)
    return _short(system) if _short(system) in LANGUAGES else ENGLISH


def _short(name: str) -> str:
    """Return the language of a locale: ``de`` of ``de_AT.UTF-8``."""
    return name.replace("-", "_").split("_")[0].split(".")[0].lower()

"""Shared by the commands: the console, and pictures as files.

In: texts, tables, arrays of pixels, points. Out: text for terminals and pipes, PNG, PGM, SVG.

Read `_console` (language, printing, tables for any width, Ctrl-C), then `_svg` (small
plots without a plotting library, and 16 bit images). It must not know any command.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cli.terminal._console import (
        DeferredInterrupt, PlainConsole, agrees, error_text, heads, language, lead, make_console,
        print_grid, print_notes, print_table_account, progress_line, shown, tr, tr_later, tr_word,
    )  # fmt: skip
    from ocmm_cli.terminal._svg import (
        bending, histogram, label, nice_limit, page, points_in_space, tip_map,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "DeferredInterrupt", "PlainConsole", "agrees", "bending", "error_text", "heads", "histogram",
    "label", "language", "lead", "make_console", "nice_limit", "page", "points_in_space",
    "print_grid", "print_notes", "print_table_account", "progress_line", "shown", "tip_map", "tr",
    "tr_later", "tr_word",
]  # fmt: skip

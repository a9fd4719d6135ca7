"""The reader of tables and points: text, CSV, PLY, OBJ, OFF, STL and PCD, with an account.

In: a file and the statements of the user (`TableOptions`). Out: rows or points in mm, and a
`TableAccount`: rows, unit, decimal sign and columns read, and lines left out with the reason.

Read `_account` (what a reader returns), `_text` and `_grid` (bytes to lines and cells), `_numbers`
(decimal signs by evidence), `_headings` and `_columns` (roles of columns), `_unit_choice`,
`_points` with `_meshes` (points and spots), `_named` (tables whose first line names the columns).
It must not know features, plans or cameras.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.tables._account import (
        COUNT_OF_POINTS, SKIPPED_BY_USER, TableAccount, TableColumn, TableOptions,
    )  # fmt: skip
    from ocmm_core.tables._columns import require_like_names
    from ocmm_core.tables._grid import (
        AccountedTable, PreviewRow, TablePreview, TableReader, preview_table,
    )  # fmt: skip
    from ocmm_core.tables._named import NamedColumns, TextRow, TextTable, read_table
    from ocmm_core.tables._numbers import NUMBER, NumberGrammar, typed_number
    from ocmm_core.tables._points import PixelTable, PointsFile, read_pixels, read_points_file
    from ocmm_core.tables._text import decoded
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "COUNT_OF_POINTS", "NUMBER", "SKIPPED_BY_USER", "AccountedTable", "NamedColumns",
    "NumberGrammar", "PixelTable", "PointsFile", "PreviewRow", "TableAccount", "TableColumn",
    "TableOptions", "TablePreview", "TableReader", "TextRow", "TextTable", "decoded",
    "preview_table", "read_pixels", "read_points_file", "read_table", "require_like_names",
    "typed_number",
]  # fmt: skip

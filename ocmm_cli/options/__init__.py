"""The table of options of all commands, and the commands made from it.

In: commands as typed functions. Out: the same with names, texts, defaults and ranges of options.

Read `_describe` (options of several groups, and how a command gets its options; those of settings
and of the window are in `ocmm_core.options`), then the tables `_jobs`,
`_servers` and `_instrument`.
An option that is not in the table is refused when its command is built, with KeyError.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cli.options._describe import (
        OPTIONS, ComputingSite, describe, described, option_of, read_typed_numbers,
    )  # fmt: skip
    from ocmm_cli.options._jobs import FORMAT_WORDS, PROFILED_WORDS
    from ocmm_cli.options._servers import ClimateOptions, JobOptions, StationChoice, StreamChoice
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "FORMAT_WORDS", "OPTIONS", "PROFILED_WORDS", "ClimateOptions", "ComputingSite", "JobOptions",
    "StationChoice", "StreamChoice", "describe", "described", "option_of", "read_typed_numbers",
]  # fmt: skip

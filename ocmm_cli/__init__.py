"""The command line: ``ocmm``.

In: arguments. Out: files, tables on the terminal, and an exit code.

Read `_app` (the commands) and `_entry` (turns every fault into a sentence and an exit code);
`_kernels` lists the compiled functions of all packages and compiles them. Packages: `measure`
(jobs, plans, reports, recall), `calibrate` (cameras, probes and tips), `bus` (cameras on the wire),
`study` (fits, speeds, simulations); `terminal` is shared. `calibrate` and `study` are independent,
and so are `bus` and `measure`.
Nothing imports it: the window starts from `composition`, as the commands do.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cli._app import app
    from ocmm_cli._entry import main
    from ocmm_cli._kernels import compile_all, compile_group, kernel_groups
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["app", "compile_all", "compile_group", "kernel_groups", "main"]

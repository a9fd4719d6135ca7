"""``ocmm calibrate``: cameras, probes and tips, on the terminal.

In: the rig, a source of frames, an artefact with its certificate, the operator's answers.
Out: records in their folder, tables of results, an exit code for the verdict.

Read `_setup` (options of every guided procedure), `_calibrate` (cameras), `_boards` (cameras by
pictures of a board), `_run` (a guided procedure on the terminal), `_steps`, then the probe:
`_probe` (also its tips), `_tip`; optical trackers: `_tracker`. `_report` and `_tip_report` print;
`_write_cameras` writes into the cameras.
Procedures, gates and numbers are in `calibration`, the same for the window.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cli.calibrate._boards import calibrate_boards, take_pictures
    from ocmm_cli.calibrate._calibrate import calibrate_app
    from ocmm_cli.calibrate._probe import mount_tip, probe_command, probe_history, probe_status
    from ocmm_cli.calibrate._report import print_calibration, print_status
    from ocmm_cli.calibrate._run import (
        is_yes, open_site, record_observations, take_relocation_shots,
    )  # fmt: skip
    from ocmm_cli.calibrate._tip import check_tip_command, tip_command
    from ocmm_cli.calibrate._tracker import scale, tracker
    from ocmm_cli.calibrate._write_cameras import write_cameras
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "calibrate_app", "calibrate_boards", "check_tip_command", "is_yes", "mount_tip", "open_site",
    "print_calibration", "print_status", "probe_command", "probe_history", "probe_status",
    "record_observations", "scale", "take_pictures", "take_relocation_shots", "tip_command",
    "tracker", "write_cameras",
]  # fmt: skip

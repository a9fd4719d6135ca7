"""What to do if: symptoms in the inspector's words, and remedies."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_gui.kit import later


@dataclass(frozen=True, slots=True)
class Symptom:
    sign: str
    steps: str
    codes: tuple[str, ...] = ()
    """Prefixes of related error and refusal codes."""


SYMPTOMS = (
    Symptom(
        later("LOST: the cameras do not see the probe"),
        later("Turn the LEDs to the cameras. Follow the arrow beside the readout. Move hand, cable "
              "and part out of the line of sight. Check that the probe is switched on."),
        ("lost", "tracking.targets"),
    ),
    Symptom(
        later("LOST: LED identification is ambiguous"),
        later("Turn the probe so that all LEDs face both cameras. Cover reflections. Check that "
              "the probe in Settings is the one in your hand."),
        ("unidentified", "tracking.open"),
    ),
    Symptom(
        later("INACCURATE: the position uncertainty is too large"),
        later("Follow the hint beside the readout. Show more LEDs to both cameras. Move the part "
              "to the middle of the measuring volume."),
        ("uncertain",),
    ),
    Symptom(
        later("INACCURATE: the spots do not fit the probe"),
        later("Cover reflections and lamps. Check that the right probe is chosen. Look for a bent "
              "or knocked probe. If it stays, verify the cameras."),
        ("doubtful",),
    ),
    Symptom(
        later("INACCURATE: the ball is outside the calibrated volume"),
        later("Move the part into the measuring volume; the small picture of the 3-D view shows "
              "it."),
        ("outside",),
    ),
    Symptom(
        later("No point: the probe moved"),
        later("Rest the ball on the surface, hold still until the tone, then pull away along the "
              "normal. Steady your arm."),
        ("moving", "gap"),
    ),
    Symptom(
        later("No point: the side of the material is not known"),
        later("Approach along the normal and pull back the same way. Press I to choose how the "
              "side is found, X to flip the last point."),
        ("no_approach",),
    ),
    Symptom(
        later("No point: the touch came from another face"),
        later("Touch the feature square to its surface. If its earlier points are wrong, undo "
              "them first: Backspace."),
        ("wrong_face",),
    ),
    Symptom(
        later("No point: no feature, or several, fit the touch"),
        later("Choose the feature in the list, or switch to plan order with O. Check the "
              "alignment: F5."),
        ("no_feature", "ambiguous"),
    ),
    Symptom(
        later("No point: the job is paused"), later("Press Z to resume, then touch again."),
        ("paused",),
    ),
    Symptom(
        later("NO POINTS: the calibration of the cameras forbids it"),
        later("Read the sentence at the top. Expired or knocked: Maintain, Verify or Relocate. "
              "UNCALIBRATED results are not proven."),
        ("calibration", "rig.", "records."),
    ),
    Symptom(
        later("NO POINTS: the tip must be checked"),
        later("Maintain, Check tip: it takes a minute. After a blow or a change of the tip qualify "
              "it on the sphere."),
        ("tip", "probe."),
    ),
    Symptom(
        later("NOT READY: no new frames from the cameras"),
        later("Check power and network cables of the cameras. Maintain, Bus shows which camera is "
              "missing. Wait until all are in operation."),
        ("not_ready", "bus.", "acquisition.", "camera."),
    ),
    Symptom(
        later("The reference body is lost or has moved"),
        later("Clear the line of sight to its LEDs. Let part and cameras come to rest. It must not "
              "be moved against the part."),
        ("reference",),
    ),
    Symptom(
        later("NOT STORED: points cannot be saved"),
        later("Free disk space or connect the disk again. Points that are shown as taken are safe. "
              "Open the job again from the Start page."),
        ("storage", "job.", "recording.disk_full", "out."),
    ),
    Symptom(
        later("FAILED: a part of the program stopped"),
        later("All points taken are saved. Open the job again: Start page, Continue. If it fails "
              "again, write a support bundle."),
        ("internal.",),
    ),
    Symptom(
        later("Results: NOT PROVEN"),
        later("The value lies within U of the limit. Select it in Results to see what makes U "
              "large; more points, or a better attitude of the probe, make it smaller."),
        ("evaluation.",),
    ),
    Symptom(
        later("The plan cannot be opened"),
        later("Read which line or field the message names. Open the plan in the editor (F4), which "
              "marks what is wrong."),
        ("plan.", "document.", "step."),
    ),
    Symptom(
        later("A report cannot be written"),
        later("Choose a folder that can be written. Close the file in the other program, then "
              "press E again."),
        ("export.", "report."),
    ),
    Symptom(
        later("A setting has no effect"),
        later("Settings shows when a change applies: at once, or when the job is opened again."),
        ("settings.",),
    ),
    Symptom(
        later("The archive does not answer"),
        later("Nothing is lost: jobs wait in the outbox. Check the network and the address in "
              "Settings, Archive."),
        ("archive.", "outbox."),
    ),
    Symptom(
        later("The picture stutters or frames are late"),
        later("Close other programs. Let a technician run the doctor of this computer; Maintain, "
              "Bus shows late and lost cycles."),
        ("doctor.",),
    ),
)  # fmt: skip
"""By frequency."""

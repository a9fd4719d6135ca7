"""Sounds and flashes for recorded and refused points, and completed features."""

from __future__ import annotations

from collections.abc import Callable

from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import FeatureState, JobView, Target
from ocmm_core.measuring import MeasuredPoint, Refusal, RefusalCode
from ocmm_core.tolerances.decisions import Verdict
from ocmm_gui.kit import Approach, NoticeCentre, Sound, SoundPlayer, tr, verdict_sound
from ocmm_gui.operator._readout import Readout


class Feedback:
    """Sounds, also shown as flashes of the readout."""

    def __init__(
        self, sounds: SoundPlayer | None, notices: NoticeCentre, readout: Callable[[], Readout]
    ) -> None:
        self._sounds, self._notices, self._readout = sounds, notices, readout
        self._approach = Approach(sounds)

    def play(self, sound: Sound) -> None:
        if self._sounds is not None:
            self._sounds.play(sound)

    def taken(self, point: MeasuredPoint) -> None:
        self.play(Sound.TAKEN)
        self._readout().flash(good=True)

    def refused(self, refusal: Refusal) -> None:
        wrong = refusal.code is RefusalCode.WRONG_FACE
        self.play(Sound.WRONG_FACE if wrong else Sound.REFUSED)
        self._readout().flash(good=False)

    def announce(self, previous: JobView, job: JobView) -> None:
        """Signal newly completed parts of the same job."""
        if previous.job != job.job:
            return
        if job.complete and not previous.complete:
            # The part verdict includes the last feature.
            self._tell(job.part_verdict.shown_as)
            return
        before = {feature.name: feature.state for feature in previous.features}
        for feature in job.features:
            state = before.get(feature.name)
            if feature.state is FeatureState.DONE and state is not FeatureState.DONE:
                self._tell(job.verdict_of(feature.name).verdict)

    def _tell(self, verdict: Verdict | None) -> None:
        self.play(verdict_sound(verdict))
        self._readout().flash(good=verdict in (None, Verdict.CONFORM))

    def way(self, target: Target | None, tip_world: Float | None) -> None:
        """Play the approach of the ball, (3,) mm, to the target."""
        self._approach.feed(target, tip_world)

    def toggle_tone(self) -> None:
        self._approach.enabled = not self._approach.enabled
        self._notices.inform(
            tr("Approach tone on.") if self._approach.enabled else tr("Approach tone off.")
        )

    def close(self) -> None:
        if self._sounds is not None:
            self._sounds.close()

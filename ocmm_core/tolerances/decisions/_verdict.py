"""Result of one characteristic, and combined verdicts of several, for a feature and for the part.

Verdicts are combined only here, for all outputs; the worst characteristic leads.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

from ocmm_core.tolerances.zones import Seen

U_LABEL = "U (95 %)"
"""Heading of U; no factor, because few points widen U beyond 2 u."""

U_WORDS = "U (expanded uncertainty): in 95 of 100 cases the true value lies within U of the value"

LOW_TUR, LOWEST_TUR = 4.0, 1.0
"""Tolerance over twice U below which a result has a warning, and below which none conforms."""


class Verdict(Enum):
    """Decision, in the inspector's words."""

    CONFORM = "CONFORM"
    NOT_CONFORM = "NOT CONFORM"
    NOT_PROVEN = "NOT PROVEN"
    NOT_MEASURED = "NOT MEASURED"
    PROVISIONAL = "PROVISIONAL"
    """A feature involved is still being probed; a value may be available."""


@dataclass(frozen=True, slots=True)
class CharacteristicResult:
    """One characteristic with its value, uncertainty and verdict; in ``unit``."""

    name: str
    kind: str
    features: tuple[str, ...]
    nominal: float
    lower: float
    upper: float
    """`nominal`, `lower`, `upper`: Nominal value and the limits of the deviation."""
    measured: float | None
    deviation: float | None
    """`measured`, `deviation`: None without a trustworthy value."""
    uncertainty: float | None
    """Expanded uncertainty U; None together with ``measured``. 2 u, or more for few points or
    nonnegative values, so that value ± U covers the true value in 95 of 100 cases."""
    verdict: Verdict
    note: str = ""
    """Reason for a missing value, or a note on it; may be empty."""
    rule: str = ""
    """Decision rule with its version, from `decision.rule_id`; empty without a decision."""
    tur: float | None = None
    """Tolerance divided by twice U; None without a value or a tolerance."""
    leaning: Literal["", "in", "out"] = ""
    """Side of the limit: ``"in"`` (ILAC-G8 conditional pass), ``"out"`` (fail) or ""."""
    interval: tuple[float, float] | None = None
    """95 % interval of the true value; None together with ``measured``."""
    association: str = ""
    frame: str = ""
    floor: float | None = None
    """Value of a perfect form due to noise alone; None if not applicable."""
    bonus: float = 0.0
    """Addition to the tolerance by a material modifier."""
    unit: Literal["mm", "deg"] = "mm"
    seen: Seen | None = field(default=None, compare=False, repr=False)
    """Deviations of the touched places that make up the value, for pictures, or None."""

    @property
    def stated(self) -> tuple[float, float, float] | None:
        """Return value, deviation, U for reports; None if not measured, or provisional."""
        if (
            self.verdict in (Verdict.NOT_MEASURED, Verdict.PROVISIONAL)
            or self.measured is None
            or self.deviation is None
            or self.uncertainty is None
        ):
            return None
        return self.measured, self.deviation, self.uncertainty

    @property
    def caution(self) -> str:
        """Return the warning on a large uncertainty relative to the tolerance, or empty text."""
        if self.tur is None or self.tur >= LOW_TUR:
            return ""
        return (
            f"The tolerance is only {self.tur:.1f} times twice the uncertainty; "
            f"{LOW_TUR:.0f} times is usual."
        )


WORST_FIRST = (
    Verdict.NOT_CONFORM,
    Verdict.NOT_PROVEN,
    Verdict.NOT_MEASURED,
    Verdict.PROVISIONAL,
    Verdict.CONFORM,
)
"""Order of severity: a combination is never shown better than its worst member."""


@dataclass(frozen=True, slots=True)
class VerdictSummary:
    """The verdict on several characteristics."""

    verdict: Verdict | None
    """The worst; None without characteristics, hence without tolerance."""
    deciding: str
    counts: tuple[tuple[Verdict, int], ...]
    """Number of each occurring verdict, worst first."""

    @property
    def total(self) -> int:
        return sum(count for _, count in self.counts)

    @property
    def share(self) -> str:
        """Return the share of the verdict, e.g. ``1 of 3 NOT CONFORM``; empty below two."""
        if self.verdict is None or self.total < 2:
            return ""
        return f"{self.counts[0][1]} of {self.total} {self.verdict.value}"

    @property
    def counted(self) -> str:
        """Return all counts, worst first, e.g. ``1 NOT CONFORM, 2 CONFORM``; may be empty."""
        return ", ".join(f"{count} {verdict.value}" for verdict, count in self.counts)


NO_VERDICT = VerdictSummary(None, "", ())
"""Without tolerance."""


def summarise(results: Sequence[CharacteristicResult], feature: str = "") -> VerdictSummary:
    """Return the verdict on characteristics in the order of the plan, and the deciding one.

    Among equally bad ones, the first with a value by ``feature`` alone, with a value, or at all.
    """
    if not results:
        return NO_VERDICT
    if len(results) == 1:
        return VerdictSummary(results[0].verdict, results[0].name, ((results[0].verdict, 1),))
    found = Counter(result.verdict for result in results)
    counts = tuple((verdict, found[verdict]) for verdict in WORST_FIRST if found[verdict])
    worst = counts[0][0]
    alone = (feature,) if feature else None

    def rank(result: CharacteristicResult) -> tuple[bool, bool]:
        return result.measured is None, alone is not None and result.features != alone

    deciding = min((item for item in results if item.verdict is worst), key=rank)
    return VerdictSummary(worst, deciding.name, counts)


class PartWord(Enum):
    """The verdict on the part, in the words that the inspector reads."""

    CONFORMS = "PART CONFORMS"
    DOES_NOT_CONFORM = "PART DOES NOT CONFORM"
    NOT_PROVEN = "NOT PROVEN"
    NOT_COMPLETE = "NOT COMPLETE"
    NO_TOLERANCE = "NO TOLERANCE"


_AS_VERDICT = {
    PartWord.CONFORMS: Verdict.CONFORM,
    PartWord.DOES_NOT_CONFORM: Verdict.NOT_CONFORM,
    PartWord.NOT_PROVEN: Verdict.NOT_PROVEN,
    PartWord.NOT_COMPLETE: Verdict.NOT_MEASURED,
    PartWord.NO_TOLERANCE: None,
}


@dataclass(frozen=True, slots=True)
class RequirementCount:
    """How many requirements of a model, document or table a plan contains."""

    present: int
    total: int
    notes: int
    """Notes for people; no plan contains them."""
    origin: str
    """``model``, ``QIF document``, ``table``, or ``sources`` for several kinds."""

    @property
    def is_whole(self) -> bool:
        """Return whether the plan contains everything that its sources ask for."""
        return self.present == self.total and not self.notes

    @property
    def short(self) -> str:
        """Return the count for large letters, such as ``18 of 52 requirements``."""
        return f"{self.present:d} of {self.total:d} requirements"

    @property
    def sentence(self) -> str:
        """Return the count as a sentence without its full stop."""
        found, kind = self.present, self.origin
        if not self.notes:
            return f"{found:d} of {self.total:d} requirements of the {kind} are in this plan"
        return (
            f"{found:d} of {self.total:d} requirements of the {kind} are in this plan, "
            f"and 0 of {self.notes:d} notes"
        )


@dataclass(frozen=True, slots=True)
class PartVerdict:
    """Verdict on the part. Show `headline`, never the word alone: it names missing requirements."""

    word: PartWord
    """For decisions of the program and for columns with a fixed set of words."""
    summary: VerdictSummary
    failing: tuple[str, ...]
    unproven: tuple[str, ...]
    """`failing`, `unproven`: Names of the NOT CONFORM and NOT PROVEN characteristics."""
    missing_features: tuple[str, ...]
    """Names of incomplete features, also skipped ones."""
    unmeasured: tuple[str, ...]
    """Names of the characteristics without a final value: NOT MEASURED or PROVISIONAL."""
    requirements: RequirementCount | None = None
    """Of the sources of the plan; None without a source."""

    @property
    def requirement_words(self) -> str:
        """Return how many requirements of its sources the plan contains, or an empty text."""
        return "" if self.requirements is None else self.requirements.sentence

    @property
    def is_partial(self) -> bool:
        """Return whether the sources of the plan ask for more than the plan contains."""
        return self.requirements is not None and not self.requirements.is_whole

    @property
    def headline(self) -> str:
        """Return the word; of incomplete plans with counts (``PART CONFORMS: 18 of 52 ...``)."""
        count = self.requirement_words if self.is_partial else ""
        return f"{self.word.value}: {count}" if count else self.word.value

    @property
    def short_headline(self) -> tuple[str, ...]:
        """Return the word, and the short count if the plan lacks requirements: one line."""
        partial = self.requirements if self.is_partial else None
        return (self.word.value,) if partial is None else (self.word.value, partial.short)

    @property
    def complete(self) -> bool:
        return not self.missing_features and not self.unmeasured

    @property
    def missing(self) -> tuple[str, ...]:
        """Return the missing features, then the characteristics without a value."""
        return (*self.missing_features, *self.unmeasured)

    @property
    def verdict(self) -> Verdict | None:
        """Return the verdict of the word; None without tolerances."""
        return _AS_VERDICT[self.word]

    @property
    def shown_as(self) -> Verdict | None:
        """Return verdict, colour, sign and sound; a plan without requirements is never good."""
        count = self.requirements
        has_none = count is not None and self.is_partial and not count.present
        return Verdict.NOT_PROVEN if has_none and self.word is PartWord.CONFORMS else self.verdict

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return the reasons, worst first, e.g. ``NOT CONFORM: A, B``; empty for the best."""
        lines = (
            ("NOT CONFORM", self.failing),
            ("NOT PROVEN", self.unproven),
            ("INCOMPLETE", self.missing_features),
            ("NOT MEASURED", self.unmeasured),
        )
        return tuple(f"{word}: {', '.join(names)}" for word, names in lines if names)

    @property
    def lines(self) -> tuple[str, ...]:
        """Return headline and reasons; a first reason with the same word replaces the headline."""
        if self.reasons and self.reasons[0].startswith(f"{self.word.value}: "):
            return (*self.reasons, *((self.requirement_words,) if self.is_partial else ()))
        return (self.headline, *self.reasons)


def judge_part(
    results: Sequence[CharacteristicResult],
    missing_features: Iterable[str],
    requirements: RequirementCount | None = None,
) -> PartVerdict:
    """Return the verdict on a part from all characteristics, in the order of the plan.

    A part with a NOT CONFORM characteristic does not conform, even if incomplete. It conforms only
    if every feature is complete and all characteristics CONFORM. ``requirements`` is how many
    requirements of its sources the plan contains; it does not change the word.
    """
    summary = summarise(results)
    named = {
        verdict: tuple(item.name for item in results if item.verdict is verdict)
        for verdict in Verdict
    }
    missing = tuple(missing_features)
    unmeasured = tuple(
        item.name for item in results if item.verdict in (Verdict.NOT_MEASURED, Verdict.PROVISIONAL)
    )
    if named[Verdict.NOT_CONFORM]:
        word = PartWord.DOES_NOT_CONFORM
    elif named[Verdict.NOT_PROVEN]:
        word = PartWord.NOT_PROVEN
    elif missing or unmeasured:
        word = PartWord.NOT_COMPLETE
    else:
        word = PartWord.CONFORMS if results else PartWord.NO_TOLERANCE
    return PartVerdict(
        word, summary, named[Verdict.NOT_CONFORM], named[Verdict.NOT_PROVEN], missing, unmeasured,
        requirements,
    )  # fmt: skip

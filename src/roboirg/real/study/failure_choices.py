"""How a trial can fail, as an operator chooses it: the failures of docs/attribution.md."""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.conditions import Rule, facts_of
from roboirg.core.episode import Episode
from roboirg.judging.failure_attribution import FailureAttribution, FailureName
from roboirg.records.record import Attribution

EXECUTION_WORDS: tuple[tuple[FailureName, str], ...] = (
    ("nothing_reached", "never came near what it should handle"),
    ("missed_grasp", "did not get the right thing up"),
    ("dropped", "dropped the right thing in the air"),
    ("misplaced", "set the right thing down beside its place"),
    ("out_of_time", "was not done in time, or stopped half-way"),
)


class FailureChoice(NamedTuple):
    """One way to fail.

    Attributes:
        key: unique among a trial's, for example ``"wrong_place:box_green"``.
        failure: its name.
        subject: name of the object that it is about, if there is one.
        words: what happened, to be read after "the robot".
    """

    key: str
    failure: FailureName
    subject: str | None
    words: str

    @property
    def is_grounding(self) -> bool:
        """Whether something else was done than what was meant."""
        return self.attribution(0).kind == "grounding"

    def attribution(self, step: int, note: str = "") -> Attribution:
        """What the record says.

        Args:
            step: how long the trial was, control periods.
            note: the operator's own words.
        """
        words = f"the robot {self.words}" + (f" ({note})" if note else "")
        return Attribution(
            **FailureAttribution.of(self.failure, self.subject, step, words)._asdict()
        )


def failure_choices(episode: Episode) -> tuple[FailureChoice, ...]:
    """Every way in which a trial can fail: wrong referents by the task's rules, then execution."""
    rules = dict.fromkeys(
        rule for stage in episode.stages for rule in stage.forbids if isinstance(rule, Rule)
    )
    grounding = []
    for rule in rules:
        if rule.failure is not None:
            # As in simulation: the subject is what was handled, and the words say where it went.
            fact = facts_of(rule)[0]
            key = f"{rule.failure}:{fact.place or fact.subject}"
            grounding.append(FailureChoice(key, rule.failure, fact.subject, rule.cause))
    execution = [FailureChoice(name, name, None, words) for name, words in EXECUTION_WORDS]
    return (*grounding, *execution)

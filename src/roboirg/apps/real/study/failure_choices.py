"""The failures of a trial among which an operator chooses (docs/attribution.md)."""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.conditions import Rule, facts_of
from roboirg.core.episode import Episode
from roboirg.core.failures import FailureName
from roboirg.judging.failure_attribution import FailureAttribution
from roboirg.records.record import Attribution

OTHER_WORDS: tuple[tuple[FailureName, str], ...] = (
    ("missed_grasp", "reached the right object but did not lift it"),
    ("dropped", "dropped the right object"),
    ("misplaced", "put the right object down next to its place"),
    ("out_of_time", "ran out of time on the way"),
    ("stopped", "stopped half-way"),
    ("no_attempt", "never went to the right object"),
)


class FailureChoice(NamedTuple):
    """One way to fail.

    Attributes:
        key: unique in a trial, for example ``"wrong_place:box_green"``.
        failure: its name.
        subject: name of the object that it is about, if there is one.
        words: verb and object, to follow "the robot".
    """

    key: str
    failure: FailureName
    subject: str | None
    words: str

    def attribution(self, note: str = "") -> Attribution:
        """Return the attribution for the record; an operator counts no steps.

        Args:
            note: the operator's own words.
        """
        words = f"the robot {self.words}"
        if note:
            words += f" ({note})"
        fields = FailureAttribution.of(self.failure, self.subject, 0, words)._asdict()
        fields["step"] = None
        return Attribution(**fields)


def failure_choices(episode: Episode) -> tuple[FailureChoice, ...]:
    """Return the failures of a trial among which an operator chooses.

    First those by the task's rules, such as *put the tape into the purple box*; then the others,
    which are the same for all tasks. Pages number them in this order.
    """
    choices = []
    for rule in _rules_of(episode):
        if rule.failure is not None:
            # As in simulation: the subject is the object that was handled, and the words its place.
            fact = facts_of(rule)[0]
            key = f"{rule.failure}:{fact.place or fact.subject}"
            choices.append(FailureChoice(key, rule.failure, fact.subject, rule.cause))
    for name, words in OTHER_WORDS:
        choices.append(FailureChoice(name, name, None, words))
    return tuple(choices)


def _rules_of(episode: Episode) -> list[Rule]:
    """Return the rules that stages forbid to break, each once, in the order of the stages."""
    found: dict[Rule, None] = {}
    for stage in episode.stages:
        for condition in stage.forbids:
            if isinstance(condition, Rule):
                found[condition] = None
    return list(found)

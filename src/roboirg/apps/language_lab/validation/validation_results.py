"""The results of a validation: counts that add up, and the rules that were broken."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from roboirg.core.episode import Difficulty

Rule = Literal["read back", "necessity", "self-contained", "no leak", "pairing", "expressible"]


class RuleViolation(NamedTuple):
    """Words that break a rule.

    Attributes:
        rule: the rule.
        task: name of the task.
        setting: name of the setting.
        episode: key of the episode, which identifies it together with the seed.
        seed: seed of the episode.
        words: the prompt or command, the difference, or the reason of a refusal.
    """

    rule: Rule
    task: str
    setting: str
    episode: str
    seed: int
    words: str


class EpisodeGroup(NamedTuple):
    """Episodes of a task in a setting.

    Attributes:
        task: name of the task.
        setting: name of the setting.
        detail: main reasoning pattern of their commands, or values of the setting's options, for
            example ``camera``; may be empty.
        difficulty: of their scenes.
    """

    task: str
    setting: str
    detail: str
    difficulty: Difficulty


class Refusal(NamedTuple):
    """A setting, and a reason for which it refuses scenes."""

    setting: str
    reason: str


@dataclass(slots=True)
class ValidationResults:
    """The results for one episode or many.

    Attributes:
        texts: prompts read, by task and setting.
        commands: episodes whose implicit command was read alone.
        exceptions: those of them whose scene leaves a single candidate.
        scenes: scenes of the settings that may refuse.
        refused: those of them that were refused.
        reasons: how often each reason was given.
        failures: all violations of rules.
    """

    texts: Counter[tuple[str, str]] = field(default_factory=Counter)
    commands: Counter[EpisodeGroup] = field(default_factory=Counter)
    exceptions: Counter[EpisodeGroup] = field(default_factory=Counter)
    scenes: Counter[EpisodeGroup] = field(default_factory=Counter)
    refused: Counter[EpisodeGroup] = field(default_factory=Counter)
    reasons: Counter[Refusal] = field(default_factory=Counter)
    failures: list[RuleViolation] = field(default_factory=list)

    def add(self, other: ValidationResults) -> None:
        for name in ("texts", "commands", "exceptions", "scenes", "refused", "reasons"):
            getattr(self, name).update(getattr(other, name))
        self.failures.extend(other.failures)

"""What a proof has seen: counts that can be added up, and what failed."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from roboirg.core.episode import Difficulty

Rule = Literal["read back", "necessity", "self-contained", "no leak", "pairing", "expressible"]


class RuleViolation(NamedTuple):
    """Words that break a rule.

    Attributes:
        rule: which one.
        task: name of the task.
        setting: of the words.
        episode: its key; together with the seed it tells which one.
        seed: of the episode.
        words: the prompt or command, or what differs.
    """

    rule: Rule
    task: str
    setting: str
    episode: str
    seed: int
    words: str


class CommandGroup(NamedTuple):
    """A group of episodes told in a setting.

    Attributes:
        task: name of the task.
        setting: how they are told.
        pattern: main reasoning pattern; None in the other settings.
        difficulty: of their scenes.
    """

    task: str
    setting: str
    pattern: str | None
    difficulty: Difficulty


class LandmarkGroup(NamedTuple):
    """Scenes whose targets are to be told by their places."""

    task: str
    difficulty: Difficulty
    frame: str


@dataclass(slots=True)
class ValidationResults:
    """What was found, of one episode or of many.

    Attributes:
        texts: prompts read, by task and setting.
        commands: episodes whose implicit command was read alone.
        exceptions: those of them whose scene leaves a single candidate.
        scenes: scenes that ask for a landmark.
        unplaced: those of them without any.
        failures: everything that breaks a rule.
    """

    texts: Counter[tuple[str, str]] = field(default_factory=Counter)
    commands: Counter[CommandGroup] = field(default_factory=Counter)
    exceptions: Counter[CommandGroup] = field(default_factory=Counter)
    scenes: Counter[LandmarkGroup] = field(default_factory=Counter)
    unplaced: Counter[LandmarkGroup] = field(default_factory=Counter)
    failures: list[RuleViolation] = field(default_factory=list)

    def add(self, other: ValidationResults) -> None:
        """Take in what another one has seen."""
        self.texts.update(other.texts)
        self.commands.update(other.commands)
        self.exceptions.update(other.exceptions)
        self.scenes.update(other.scenes)
        self.unplaced.update(other.unplaced)
        self.failures.extend(other.failures)

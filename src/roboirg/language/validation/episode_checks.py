"""One episode, told in every way and read back by the independent reader."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator

from roboirg.core.episode import Episode
from roboirg.language.generator import expressible
from roboirg.language.instruction import Instruction
from roboirg.language.interpreter import Interpretation, interpret
from roboirg.language.landmarks import FRAMES
from roboirg.language.settings import settings_of
from roboirg.language.validation.evidence import (
    CommandGroup,
    LandmarkGroup,
    Rule,
    RuleViolation,
    ValidationResults,
)
from roboirg.language.validation.leaks import leaked
from roboirg.language.validation.necessity import only_candidate
from roboirg.language.validation.pairing import unpaired
from roboirg.language.variants import tellings
from roboirg.tasks import get_task

ROBOT, CAMERA = FRAMES
SPATIAL = "spatial"

Read = Callable[[str], Interpretation]
"""Reads a text about the scene at hand."""
Broken = tuple[Rule, str]
"""A rule and the words that break it."""


def check_episode(episode: Episode, *, must_be_expressible: bool = False) -> ValidationResults:
    """Everything that the words of an episode have to prove.

    Args:
        episode: any, of a split or not.
        must_be_expressible: whether it fails if the robot's frame cannot tell its places.
    """
    found = ValidationResults()
    # Texts return (stages 1 and 5 are the direct ones): each is read once.
    read = functools.cache(lambda text: interpret(text, episode.scene, episode.task))
    commands: dict[str, set[str]] = {}
    for telling in tellings(episode):
        instruction = telling.of(episode)
        found.texts[episode.task, telling.setting] += 1
        broken = list(not_read_back(instruction, episode, read))
        if telling.implicit:
            known = commands.setdefault(telling.setting, set())
            if instruction.command not in known:
                exception = only_candidate(episode, instruction)
                if not known:
                    _count(instruction, episode, found, exception=exception)
                known.add(instruction.command)
                broken += not_needed(instruction, episode, read, exception=exception)
                broken += leaking(instruction, episode)
        elif instruction.metadata["frame"] != CAMERA:
            # Whose left the camera's picture means is no reference: it stays in the introduction.
            broken += not_self_contained(instruction, episode, read)
        found.failures += [
            _failure(episode, telling.setting, rule, words) for rule, words in broken
        ]
    found.failures += [
        _failure(episode, setting, "pairing", words)
        for setting, words in unpaired(episode, expressible(episode))
    ]
    _look_for_landmarks(episode, found, must_be_expressible=must_be_expressible)
    return found


def not_read_back(instruction: Instruction, episode: Episode, read: Read) -> Iterator[Broken]:
    """The prompt, unless it is read as exactly the episode's goal and understood to the end."""
    heard = read(instruction.text)
    if heard.goals != (episode.goal,) or heard.not_understood:
        yield "read back", instruction.text


def not_self_contained(instruction: Instruction, episode: Episode, read: Read) -> Iterator[Broken]:
    """An explicit or resolved command that is not read as the goal without its context."""
    heard = read(instruction.command)
    if heard.goals != (episode.goal,) or heard.not_understood:
        yield "self-contained", instruction.command


def not_needed(
    instruction: Instruction, episode: Episode, read: Read, *, exception: bool
) -> Iterator[Broken]:
    """An implicit command that tells the goal without its context, or contradicts it.

    Args:
        instruction: of an implicit form.
        episode: whose it is.
        read: the reader.
        exception: whether the scene leaves one candidate; then the command has to tell it.
    """
    left = read(instruction.command).goals
    if episode.goal not in left or (len(left) == 1) != exception:
        yield "necessity", instruction.command


def leaking(instruction: Instruction, episode: Episode) -> Iterator[Broken]:
    """An implicit command that contains a hidden value."""
    words = leaked(instruction, episode.goal)
    if words:
        yield "no leak", f"{', '.join(sorted(words))} in: {instruction.command}"


def _count(
    instruction: Instruction, episode: Episode, found: ValidationResults, *, exception: bool
) -> None:
    pattern = instruction.metadata["pattern"]
    group = CommandGroup(
        task=episode.task,
        setting=instruction.setting,
        pattern=None if pattern is None else str(pattern),
        difficulty=episode.difficulty,
    )
    found.commands[group] += 1
    found.exceptions[group] += exception


def _look_for_landmarks(
    episode: Episode, found: ValidationResults, *, must_be_expressible: bool
) -> None:
    if SPATIAL not in settings_of(get_task(episode.task)):
        return
    for frame in FRAMES:
        group = LandmarkGroup(episode.task, episode.difficulty, frame)
        lacking = SPATIAL not in expressible(episode, frame=frame)
        found.scenes[group] += 1
        found.unplaced[group] += lacking
        if lacking and must_be_expressible and frame == ROBOT:
            words = "no landmark tells its target"
            found.failures.append(_failure(episode, SPATIAL, "expressible", words))


def _failure(episode: Episode, setting: str, rule: Rule, words: str) -> RuleViolation:
    return RuleViolation(rule, episode.task, setting, episode.key, episode.seed, words)

"""The words of a control arm, and the goal that they state."""

from __future__ import annotations

import contextlib
import re
import zlib
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from roboirg.core.arms import (
    OTHER_GOAL,
    SCRAMBLED,
    SILENT_TEXTS,
    TOLD,
    check_arm,
    paraphrase_number,
)
from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.generator import instruct_with
from roboirg.language.goal_fields import goal_name
from roboirg.language.instruction import Instruction, Meaning, Utterance
from roboirg.language.settings import EXPLICIT
from roboirg.tasks import get_task, with_goal
from roboirg.tasks.other_goals import draw_other_goal
from roboirg.util.random_draws import shuffled

FUNCTION_WORDS = (
    "a an and are as at be been but by can could for from had has have i if in into is it its let "
    "me my of on onto or please she so some such that the their them then there these they this "
    "those to up was we were which who will with would you your"
)
"""Words that a scrambled text leaves out; all others are content words."""

_MOST_DRAWS = 60
"""How often the words of an episode are drawn again for one more paraphrase."""
_WORD = re.compile(r"[^\W_]+(?:['’-][^\W_]+)*")
_KEPT_NOTES = ("pattern", "patterns", "relation", "rival")
"""Notes in which a paraphrase equals the told text: it takes the same reasoning."""


class ArmWords(NamedTuple):
    """What is said in an arm of a scene.

    Attributes:
        episode: the episode, with the goal by which its verdict falls.
        instruction: what is said.
        original: the scene's own episode, if the words state another goal; else None.
    """

    episode: Episode
    instruction: Instruction
    original: Episode | None = None


class TrialWords(NamedTuple):
    """Everything that is said of a trial.

    Attributes:
        episode: the episode, with the goal by which its verdict falls.
        instruction: what is said.
        command: the explicit command of its goal.
        stated: its goal in words.
        goals: the episode with each goal that its scene allows, by the goal's words.
    """

    episode: Episode
    instruction: Instruction
    command: str
    stated: str
    goals: Mapping[str, Episode]


def arm_episode(episode: Episode, arm: str) -> Episode:
    """Return the episode with the goal by which an arm's verdict falls.

    Raises:
        UnknownNameError: there is no such arm.
        InvalidValueError: the scene has no other goal.
    """
    check_arm(arm)
    if arm != OTHER_GOAL:
        return episode
    goal = draw_other_goal(episode)
    if goal is None:
        raise InvalidValueError(f"The scene of {episode.key} has no other goal with as many picks.")
    return with_goal(episode, goal)


def say_arm(episode: Episode, options: InstructionOptions, arm: str = TOLD) -> ArmWords:
    """Return what is said in an arm of an episode; the same arguments give the same bytes.

    Raises:
        UnknownNameError: there is no such arm.
        InvalidValueError: the options cannot express the goal, the scene has no other goal, or
            there is no further paraphrase.
    """
    stated = arm_episode(episode, arm)
    told = instruct_with(stated, options)
    number = paraphrase_number(arm)
    if number is not None:
        told = _paraphrase(stated, options, told, number)
    elif arm in SILENT_TEXTS:
        # No words leave all goals, where scrambled ones have a meaning that is not known.
        nothing = None if told.meaning is None else Meaning({})
        told = _with_texts(told, (SILENT_TEXTS[arm],), nothing)
    elif arm == SCRAMBLED:
        told = _scramble(stated, told)
    return ArmWords(stated, told, None if stated is episode else episode)


def word_trial(episode: Episode, options: InstructionOptions, arm: str = TOLD) -> TrialWords:
    """Return everything that is said of an arm of an episode; raises like `say_arm`."""
    stated, told, _ = say_arm(episode, options, arm)
    is_explicit = (options.setting, arm) == (EXPLICIT, TOLD)
    explicit = told if is_explicit else instruct_with(stated, replace(options, setting=EXPLICIT))
    every = get_task(stated.task).goals(stated.scene)
    goals = {goal_name(goal): with_goal(stated, goal) for goal in every}
    return TrialWords(stated, told, explicit.text, goal_name(stated.goal), goals)


def _paraphrase(
    episode: Episode, options: InstructionOptions, told: Instruction, number: int
) -> Instruction:
    """Return the paraphrase of a number: another text than the told one and those before it."""
    seen = {told.text}
    kept = [told.metadata.get(name) for name in _KEPT_NOTES]
    for variant in range(1, number * _MOST_DRAWS + 1):
        with contextlib.suppress(InvalidValueError):  # a setting may refuse what was drawn
            other = instruct_with(episode, options, variant)
            if [other.metadata.get(name) for name in _KEPT_NOTES] == kept:
                seen.add(other.text)
            if len(seen) > number:
                return other
    raise InvalidValueError(
        f"The {options.setting} setting has no paraphrase {number} of episode {episode.key}."
    )


def _scramble(episode: Episode, told: Instruction) -> Instruction:
    """Return the content words in random order, as many in each utterance as before."""
    skipped = frozenset(FUNCTION_WORDS.split())
    words = [
        [word for text in _WORD.findall(one) if (word := text.lower()) not in skipped]
        for one in told.turns
    ]
    every = [word for each in words for word in each]
    if len(set(every)) < 2:  # noqa: PLR2004
        raise InvalidValueError(f"The text of {episode.key} has no other order: {told.text!r}.")
    rng = np.random.default_rng([episode.seed, zlib.crc32(told.text.encode())])
    order = every
    while order == every:
        order = shuffled(rng, every)
    rest = iter(order)
    return _with_texts(told, tuple(" ".join(next(rest) for _ in each) for each in words))


def _with_texts(
    told: Instruction, texts: tuple[str, ...], meaning: Meaning | None = None
) -> Instruction:
    """Return an instruction of other texts, which mention nothing; the last is the command."""
    stages = [utterance.stage for utterance in told.utterances][-len(texts) :]
    utterances = tuple(map(Utterance, stages, texts))
    return replace(told, utterances=utterances, mentions=(), meaning=meaning)

"""The words of a control arm, and the goal that they state."""

from __future__ import annotations

import contextlib
import itertools
import re
import zlib
from collections.abc import Mapping, Sequence
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
    judged = arm_episode(episode, arm)
    original = None if judged is episode else episode
    instruction = instruct_with(judged, options)
    number = paraphrase_number(arm)  # None for other arms
    if number is not None:
        instruction = _paraphrase(judged, options, instruction, number)
    elif arm == SCRAMBLED:
        instruction = _scramble(judged, instruction)
    elif arm in SILENT_TEXTS:
        instruction = _silence(instruction, SILENT_TEXTS[arm])
    return ArmWords(judged, instruction, original)


def word_trial(episode: Episode, options: InstructionOptions, arm: str = TOLD) -> TrialWords:
    """Return everything that is said of an arm of an episode; raises like `say_arm`."""
    words = say_arm(episode, options, arm)
    judged = words.episode
    explicit = words.instruction
    if options.setting != EXPLICIT or arm != TOLD:
        explicit = instruct_with(judged, replace(options, setting=EXPLICIT))
    return TrialWords(
        judged,
        words.instruction,
        command=explicit.text,
        stated=goal_name(judged.goal),
        goals=_episodes_by_goal(judged),
    )


def _episodes_by_goal(episode: Episode) -> dict[str, Episode]:
    """Return an episode with each goal that its scene allows, by the goal's words."""
    goals = get_task(episode.task).goals(episode.scene)
    return {goal_name(goal): with_goal(episode, goal) for goal in goals}


def _paraphrase(
    episode: Episode, options: InstructionOptions, usual: Instruction, number: int
) -> Instruction:
    """Return the paraphrase of a number, from 1: another text than the usual one and those before.

    Words are drawn again until so many different texts with the same reasoning have come up.
    """
    seen = {usual.text}
    for variant in range(1, number * _MOST_DRAWS + 1):
        with contextlib.suppress(InvalidValueError):  # a setting may refuse what was drawn
            other = instruct_with(episode, options, variant)
            if _notes_to_keep(other) == _notes_to_keep(usual):
                seen.add(other.text)
            if len(seen) > number:  # the usual text is among them
                return other
    raise InvalidValueError(
        f"The {options.setting} setting has no paraphrase {number} of episode {episode.key}."
    )


def _notes_to_keep(instruction: Instruction) -> list[object]:
    """Return the notes in which a paraphrase equals the told text."""
    return [instruction.metadata.get(name) for name in _KEPT_NOTES]


def _silence(instruction: Instruction, text: str) -> Instruction:
    """Return a text that says nothing about the goal; it leaves all goals of the scene."""
    meaning = None if instruction.meaning is None else Meaning({})
    return _with_texts(instruction, [text], meaning)


def _scramble(episode: Episode, instruction: Instruction) -> Instruction:
    """Return the content words in random order, as many in each utterance as before.

    *Please lift the red cube.* may become *cube red lift*. What that means is not known.
    """
    by_turn = [_content_words(turn) for turn in instruction.turns]
    words = list(itertools.chain.from_iterable(by_turn))
    if len(set(words)) < 2:  # noqa: PLR2004
        text = instruction.text
        raise InvalidValueError(f"The text of {episode.key} has no other order: {text!r}.")
    rng = np.random.default_rng([episode.seed, zlib.crc32(instruction.text.encode())])
    order = words
    while order == words:
        order = shuffled(rng, words)
    left = iter(order)  # each turn takes the next of them
    texts = [" ".join(itertools.islice(left, len(turn_words))) for turn_words in by_turn]
    return _with_texts(instruction, texts)


def _content_words(text: str) -> list[str]:
    """Return the words of a text in lower case, without `FUNCTION_WORDS`."""
    function_words = FUNCTION_WORDS.split()
    words = [word.lower() for word in _WORD.findall(text)]
    return [word for word in words if word not in function_words]


def _with_texts(
    instruction: Instruction, texts: Sequence[str], meaning: Meaning | None = None
) -> Instruction:
    """Return an instruction of other texts, which mention nothing; the last is the command.

    Fewer texts than there are utterances stand for the last ones.
    """
    spoken = instruction.utterances[-len(texts) :]
    utterances = [
        Utterance(utterance.stage, text) for utterance, text in zip(spoken, texts, strict=True)
    ]
    return replace(instruction, utterances=tuple(utterances), mentions=(), meaning=meaning)

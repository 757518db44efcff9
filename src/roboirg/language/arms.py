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
"""Notes in which a paraphrase equals the scene's own text: it takes the same reasoning."""


class ArmWords(NamedTuple):
    """What is said of a scene in one arm, a variant of the words for a comparison.

    Attributes:
        episode: the episode, with the goal by which its verdict falls.
        instruction: what is said.
        original: the scene's own episode, if the words state another goal; else None.
    """

    episode: Episode
    instruction: Instruction
    original: Episode | None = None


class TrialWords(NamedTuple):
    """Everything that is said of a trial, one playing of an episode.

    Attributes:
        episode: the episode, with the goal by which its verdict falls.
        instruction: what is said.
        command: the explicit command of its goal.
        stated: its goal in words, ``color red, repeats 3``.
        goals: the episode with each goal that its scene allows, by the goal's words.
    """

    episode: Episode
    instruction: Instruction
    command: str
    stated: str
    goals: Mapping[str, Episode]


def arm_episode(episode: Episode, arm: str) -> Episode:
    """Return the episode with the goal by which the policy is judged in an arm.

    An arm is a variant of what the policy hears of the same scene. In the arm `OTHER_GOAL` the
    words state another goal, drawn for the scene, and the returned episode has that goal. All other
    arms return `episode` itself.

    Raises:
        UnknownNameError: there is no such arm.
        InvalidValueError: the scene has no other goal.
    """
    check_arm(arm)
    if arm != OTHER_GOAL:
        return episode
    other_goal = draw_other_goal(episode)
    if other_goal is None:
        raise InvalidValueError(f"The scene of {episode.key} has no other goal with as many picks.")
    return with_goal(episode, other_goal)


def say_arm(episode: Episode, options: InstructionOptions, arm: str = TOLD) -> ArmWords:
    """Return what is said in an arm, a variant of the words; equal arguments give equal bytes.

    The arm may keep the usual instruction, paraphrase it, scramble its words, replace it by a text
    that says nothing of the goal, or state another goal of the scene.

    Raises:
        UnknownNameError: there is no such arm.
        InvalidValueError: the options cannot express the goal, the scene has no other goal, or
            there is no further paraphrase.
    """
    judged_episode = arm_episode(episode, arm)
    original = None if judged_episode is episode else episode
    instruction = instruct_with(judged_episode, options)
    number = paraphrase_number(arm)  # None for other arms
    if number is not None:
        instruction = _paraphrase(judged_episode, options, instruction, number)
    elif arm == SCRAMBLED:
        instruction = _scramble(judged_episode, instruction)
    elif arm in SILENT_TEXTS:
        instruction = _silence(instruction, SILENT_TEXTS[arm])
    return ArmWords(judged_episode, instruction, original)


def word_trial(episode: Episode, options: InstructionOptions, arm: str = TOLD) -> TrialWords:
    """Return what the policy hears in an arm, with the explicit command and the goals in words.

    An arm is a variant of what is said of a scene, for a comparison. The goals are those among
    which a guesser could choose. Arguments and errors are those of `say_arm`.
    """
    words = say_arm(episode, options, arm)
    judged_episode = words.episode
    explicit = words.instruction
    if options.setting != EXPLICIT or arm != TOLD:
        explicit = instruct_with(judged_episode, replace(options, setting=EXPLICIT))
    return TrialWords(
        judged_episode,
        words.instruction,
        command=explicit.text,
        stated=goal_name(judged_episode.goal),
        goals=_episodes_by_goal(judged_episode),
    )


def _episodes_by_goal(episode: Episode) -> dict[str, Episode]:
    """Return an episode with each goal that its scene allows, by the goal's words."""
    goals = get_task(episode.task).goals(episode.scene)
    return {goal_name(goal): with_goal(episode, goal) for goal in goals}


def _paraphrase(
    episode: Episode, options: InstructionOptions, usual: Instruction, number: int
) -> Instruction:
    """Return the instruction in other words: paraphrase 1, 2, ..., all with different texts.

    Words are drawn again, variant after variant, until `number` texts other than the usual one have
    come up; the last of them is returned. Only texts that take the same reasoning count, and
    variants that the setting refuses do not.

    Args:
        episode: what to say.
        options: how to say it.
        usual: the instruction that is not paraphrased.
        number: which paraphrase, from 1.

    Raises:
        InvalidValueError: too few different texts were drawn.
    """
    different_texts = {usual.text}
    for variant in range(1, number * _MOST_DRAWS + 1):
        with contextlib.suppress(InvalidValueError):  # a setting may refuse what was drawn
            paraphrase = instruct_with(episode, options, variant)
            if _notes_to_keep(paraphrase) == _notes_to_keep(usual):
                different_texts.add(paraphrase.text)
            if len(different_texts) > number:  # the usual text is among them
                return paraphrase
    raise InvalidValueError(
        f"The {options.setting} setting has no paraphrase {number} of episode {episode.key}."
    )


def _notes_to_keep(instruction: Instruction) -> list[object]:
    """Return the entries of the metadata in which a paraphrase must equal the usual text."""
    return [instruction.metadata.get(name) for name in _KEPT_NOTES]


def _silence(instruction: Instruction, text: str) -> Instruction:
    """Return the instruction with a text that says nothing about the goal.

    ``Please do your task.`` means all goals of the scene; if the instruction declares no meaning,
    neither does the result.
    """
    meaning = None if instruction.meaning is None else Meaning({})
    return _with_texts(instruction, [text], meaning)


def _scramble(episode: Episode, instruction: Instruction) -> Instruction:
    """Return the instruction with its content words in random order, and no function words.

    *Please lift the red cube.* may become *cube red lift*. Each utterance keeps its number of
    content words; what the new text means is not known. The order depends on the episode and the
    text only.

    Raises:
        InvalidValueError: fewer than two different words are left, so there is no other order.
    """
    words_by_utterance = [_content_words(utterance_text) for utterance_text in instruction.turns]
    words = list(itertools.chain.from_iterable(words_by_utterance))
    text = instruction.text
    if len(set(words)) < 2:  # noqa: PLR2004
        raise InvalidValueError(f"The text of {episode.key} has no other order: {text!r}.")
    rng = np.random.default_rng([episode.seed, zlib.crc32(text.encode())])
    new_order = words
    while new_order == words:
        new_order = shuffled(rng, words)
    next_words = iter(new_order)
    texts = []
    for utterance_words in words_by_utterance:
        texts.append(" ".join(itertools.islice(next_words, len(utterance_words))))
    return _with_texts(instruction, texts)


def _content_words(text: str) -> list[str]:
    """Return the words of a text in lower case, in order, without `FUNCTION_WORDS`."""
    function_words = FUNCTION_WORDS.split()
    words = [word.lower() for word in _WORD.findall(text)]
    return [word for word in words if word not in function_words]


def _with_texts(
    instruction: Instruction, texts: Sequence[str], meaning: Meaning | None = None
) -> Instruction:
    """Return an instruction with other texts for its utterances, and no mentions.

    Fewer texts than there are utterances stand for the last ones; the last text is the command.

    Args:
        instruction: whose stages and metadata are kept.
        texts: at least one.
        meaning: of the texts; None if it is not known.
    """
    spoken = instruction.utterances[-len(texts) :]
    utterances = [
        Utterance(utterance.stage, text) for utterance, text in zip(spoken, texts, strict=True)
    ]
    return replace(instruction, utterances=tuple(utterances), mentions=(), meaning=meaning)

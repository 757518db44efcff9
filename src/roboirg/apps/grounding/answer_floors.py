"""Answers of those who do not look: oracle, chance, the command alone, shortcuts, words alone.

Each is a floor: what a model must be above to have shown that it sees and understands.
"""

from __future__ import annotations

import functools
import json
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from roboirg.apps.grounding.answer_scores import OWN_WORDS
from roboirg.apps.grounding.items.answer_file import Answer
from roboirg.apps.grounding.items.grounding_item import LETTERS, QUESTION_KINDS, GroundingItem
from roboirg.apps.grounding.items.verdicts import right_reply
from roboirg.core.episode import Episode, Goal
from roboirg.language.generator import instruct_with
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.shortcuts.command_chance import goals_of_command
from roboirg.shortcuts.goal_learner import LearnerInput
from roboirg.shortcuts.shortcut_tables import learn_goals
from roboirg.shortcuts.surface_rules import SURFACE_RULES
from roboirg.shortcuts.text_guess import TextGuess, draw_goal, guess_goal
from roboirg.tasks import goals_of
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.random_draws import draw

ORACLE = "oracle"
CHANCE = "chance"
COMMAND = "command"
TEXT_ONLY = "text-only"

Guess = Callable[[GroundingItem, Episode, np.random.Generator], Goal | None]
"""Returns the goal that an item is taken to mean; None for none of the scene."""


def floor_answers(name: str, items: Sequence[GroundingItem], seed: int = 0) -> Iterator[Answer]:
    """Yield the answers that a listener without understanding gives, to compare models with.

    These listeners are the floors; the oracle, which knows the goal, is the exception. All answer
    the questions for a goal's values (slots) and for one of several goals (choice); oracle and
    chance also point at pixels. Random numbers depend on seed, floor and item alone, not on the
    other items.

    Args:
        name: one of `FLOORS`, such as ``"chance"``.
        items: questions.
        seed: of all random choices.

    Raises:
        MissingDependencyError: a learned floor is wanted, and scikit-learn is not installed.
    """
    if name == ORACLE:
        yield from _right_answers(items)
        return
    guess = _learned_guess(items) if name == TEXT_ONLY else _GUESSES[name]
    for item in items:
        rng = np.random.default_rng([seed, zlib.crc32(f"{name} {item.id}".encode())])
        episode = get_episode(item.task, item.split, item.episode)
        yield from _goal_answers(item, guess(item, episode, rng), rng)
        if name == CHANCE:
            yield Answer(item.id, "points", _random_points(item, rng))


def _right_answers(items: Iterable[GroundingItem]) -> Iterator[Answer]:
    """Yield the right answers to all questions."""
    for item in items:
        for kind in QUESTION_KINDS:
            yield Answer(item.id, kind, right_reply(item, kind))


def _learned_guess(items: Sequence[GroundingItem]) -> Guess:
    """Return the guess of the learner of words alone."""
    learned = _learn(items)
    return lambda item, episode, rng: draw_goal(learned[item.id], goals_of(episode), rng)


def _goal_answers(
    item: GroundingItem, goal: Goal | None, rng: np.random.Generator
) -> Iterator[Answer]:
    """Yield a guessed goal as two answers: as values in JSON (slots), and as a letter (choice).

    Red, once -> ``'{"color": "red", "repeats": 1}'`` and ``"B"``. If the goal is none of the
    choices, the letter is drawn at random. Without a goal (None) the slots are empty, which is
    wrong.
    """
    answer = None if goal is None else goal_schema(item.task).answers[goal]
    yield Answer(item.id, "slots", answer or "")
    if answer in item.choice_answers:
        place = item.choice_answers.index(answer)
    else:
        place = int(rng.integers(len(item.choices)))
    yield Answer(item.id, "choice", LETTERS[place])


def _random_points(item: GroundingItem, rng: np.random.Generator) -> str:
    """Return a random pixel for each thing to point at: ``{"points": [{"x": 17, "y": 203}]}``."""
    pixels = []
    for point in item.points:
        height, width = point.size  # of the picture
        pixels.append({"x": int(rng.integers(width)), "y": int(rng.integers(height))})
    return json.dumps({"points": pixels})


def _random_goal(_item: GroundingItem, episode: Episode, rng: np.random.Generator) -> Goal:
    """Guess any goal of the scene, all equally likely."""
    return draw(rng, goals_of(episode))


def _command_goal(item: GroundingItem, episode: Episode, rng: np.random.Generator) -> Goal:
    """Guess a goal that fits the command alone, or any goal if those are not known."""
    return draw(rng, _left_by_command(item, episode) or goals_of(episode))


def _left_by_command(item: GroundingItem, episode: Episode) -> tuple[Goal, ...]:
    """Return the goals that fit the command alone; none if they are not known."""
    wordings = None if item.wordings == OWN_WORDS else item.wordings
    instruction = instruct_with(episode, replace(item.options, wordings=wordings))
    return goals_of_command(instruction, episode)


def _rule_goal(
    rule: str, item: GroundingItem, episode: Episode, rng: np.random.Generator
) -> Goal | None:
    """Guess the goal that a surface rule, such as *first mention*, finds in the words, if any."""
    return draw_goal(guess_goal(rule, item.text, item.task), goals_of(episode), rng)


_GUESSES: Mapping[str, Guess] = {
    CHANCE: _random_goal,
    COMMAND: _command_goal,
    **{rule: functools.partial(_rule_goal, rule) for rule in SURFACE_RULES},
}

FLOORS = (ORACLE, *_GUESSES, TEXT_ONLY)
"""Names: the truth; a goal of the scene at random; one that fits the command alone; the surface
rules; and the learner of words, trained on the same options."""


def _learn(items: Sequence[GroundingItem]) -> dict[str, TextGuess]:
    """Return, by the ids of items, the goals that a learner guesses from their words alone.

    It is trained anew for each task and set of instruction options, as these say things
    differently.
    """
    groups = defaultdict(list)
    for item in items:
        groups[item.task, item.options].append(item)
    guess_by_id = {}
    for (task, options), group in groups.items():
        learner = learn_goals(task, options, scenes=0)  # no random ones besides the splits'
        heard = [LearnerInput(item.text, item.hidden_slots) for item in group]
        guesses = learner.guesses("text-only", heard)
        for item, guess in zip(group, guesses, strict=True):
            guess_by_id[item.id] = guess
    return guess_by_id

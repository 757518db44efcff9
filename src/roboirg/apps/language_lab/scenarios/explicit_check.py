"""Check commands and whole sentences: what is said of a goal of the published scenes means it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from roboirg.apps.language_lab.scenarios.scenario_check import SHOWN, length_complaint
from roboirg.core.episode import Episode, Goal
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import PoolName, pool_of
from roboirg.language.generator import request_of, spoken_instruction
from roboirg.language.goal_fields import goal_fields, unordered
from roboirg.language.instruction import Instruction
from roboirg.language.scenarios.literals import in_words, say_literal
from roboirg.language.scenarios.scenario import TaskScenarios
from roboirg.language.scenarios.scenario_file import task_scenarios
from roboirg.language.scenarios.spoken import say_explicit
from roboirg.language.token_counts import tokens_of
from roboirg.shortcuts.command_chance import is_right, understood_goals
from roboirg.tasks import goals_of, with_goal


@dataclass(slots=True)
class ExplicitReport:
    """What was found about the explicit words of a task: commands, or whole sentences.

    Attributes:
        stated: the goals that are stated.
        unstated: the goals, in words, for which a file of whole sentences has none; as keys.
        renderings: a few sentences.
        broken: what is wrong, each once; as keys.
        longest: the text with most tokens.
        unused: goals of sentences, in words, that no scene can have.
    """

    stated: set[Goal] = field(default_factory=set)
    unstated: dict[str, None] = field(default_factory=dict)
    renderings: list[str] = field(default_factory=list)
    broken: dict[str, None] = field(default_factory=dict)
    longest: str = ""
    unused: list[str] = field(default_factory=list)

    def add(self, goal: Goal, text: str) -> None:
        """Add a goal that is stated, with the text that states it; the first texts are kept."""
        self.stated.add(goal)
        self.longest = max(self.longest, text, key=tokens_of)
        if text not in self.renderings and len(self.renderings) < SHOWN:
            self.renderings.append(text)


def has_explicit_words(words: TaskScenarios, task: str) -> bool:
    """Return whether a file has sentences, commands or stated values of its own for a task.

    Args:
        words: what the file says for the task, with our words where it has none.
        task: its name.
    """
    ours = task_scenarios(task)
    if words.literals or ours is None:
        return True
    return (words.commands, words.stated) != (ours.commands, ours.stated)


def check_explicit(words: TaskScenarios, scenes: Sequence[Episode]) -> ExplicitReport:
    """Check that a file's explicit words state each goal of some scenes, and nothing else.

    Each goal is said once in the words of each pool (train and test).

    Args:
        words: what the file says for a task: whole sentences by goal, or else commands.
        scenes: episodes of the task.
    """
    report = ExplicitReport(unused=_unused_goals(words, scenes))
    for episode in _goals_once(scenes):
        if words.literals and unordered(episode.goal) not in words.literals:
            report.unstated[in_words(episode.goal)] = None
        else:
            _check_goal(report, words, episode)
    too_long = length_complaint(report.longest)
    if too_long:
        report.broken[f"{too_long}: {report.longest}"] = None
    if not report.stated:
        report.broken["states no goal of the published scenes"] = None
    return report


def _unused_goals(words: TaskScenarios, scenes: Sequence[Episode]) -> list[str]:
    """Return the goals, in words, for which a file has sentences and that no scene can have."""
    possible: set[Goal] = set()
    for scene in scenes:
        possible.update(map(unordered, goals_of(scene)))
    return [in_words(goal) for goal in words.literals if goal not in possible]


def _check_goal(report: ExplicitReport, words: TaskScenarios, episode: Episode) -> None:
    """Say an episode's goal in explicit words, and add the text and what is wrong to a report.

    The words must mean this goal, or others that are equally right in the episode.

    Args:
        report: to which is added.
        words: what the file says for the task.
        episode: with the goal.
    """
    try:
        instruction = _instruction_of(words, episode)
    except InvalidValueError as error:  # a command lacks a field
        report.broken[str(error).rstrip(".")] = None
        return
    text = instruction.text
    meant = understood_goals(instruction, episode)
    if not meant or not all(is_right(goal, episode) for goal in meant):
        goal = in_words(episode.goal)
        report.broken[f"says {text!r} of the goal {goal}, and of others or none"] = None
    report.add(episode.goal, text)


def _instruction_of(words: TaskScenarios, episode: Episode) -> Instruction:
    """Return the explicit instruction of an episode: a whole sentence if there are any."""
    request = request_of(episode, InstructionOptions())
    say = say_literal if words.literals else say_explicit
    return spoken_instruction(request, say(request, words))


def _goals_once(scenes: Iterable[Episode]) -> Iterable[Episode]:
    """Return one episode for each goal that the scenes allow and each pool of words.

    Goals count only in scenes whose own goal has as many values, as the difficulty decides how many
    a goal has.
    """
    found: dict[tuple[Goal, PoolName], Episode] = {}
    for scene in scenes:
        pool = pool_of(scene.split)
        field_count = len(goal_fields(scene.goal))
        for goal in goals_of(scene):
            if len(goal_fields(goal)) == field_count and (goal, pool) not in found:
                found[goal, pool] = with_goal(scene, goal)
    return found.values()

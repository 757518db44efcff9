"""Check commands and whole sentences: what is said of a goal of the published scenes means it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from roboirg.apps.language_lab.scenarios.scenario_check import SHOWN
from roboirg.core.episode import Episode, Goal, describe_goal
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import PoolName, pool_of
from roboirg.language.generator import request_of, spoken_instruction
from roboirg.language.goal_fields import goal_fields
from roboirg.language.instruction import Instruction
from roboirg.language.scenarios.literals import say_literal
from roboirg.language.scenarios.scenario import TaskScenarios
from roboirg.language.scenarios.scenario_file import task_scenarios
from roboirg.language.scenarios.spoken import say_explicit
from roboirg.language.token_counts import USUAL_LIMIT, tokens_of, tokens_shown
from roboirg.shortcuts.command_chance import is_right, understood_goals
from roboirg.tasks import goals_of, with_goal


@dataclass(slots=True)
class ExplicitReport:
    """What was found about the explicit words of a task.

    Attributes:
        goals: number of goals that are stated.
        unstated: the goals of which the file, of whole sentences, has none.
        renderings: a few sentences.
        broken: what is wrong, each once.
        longest: the text with most tokens.
    """

    goals: int = 0
    unstated: dict[str, None] = field(default_factory=dict)
    renderings: list[str] = field(default_factory=list)
    broken: dict[str, None] = field(default_factory=dict)
    longest: str = ""


def has_explicit_words(words: TaskScenarios, task: str) -> bool:
    """Return whether a file has explicit words of its own for a task."""
    ours = task_scenarios(task)
    if words.literals or ours is None:
        return True
    return (words.commands, words.stated) != (ours.commands, ours.stated)


def check_explicit(words: TaskScenarios, scenes: Iterable[Episode]) -> ExplicitReport:
    """Check what is said of each goal that scenes allow, in the words of each pool."""
    report = ExplicitReport()
    said: set[Goal] = set()
    for episode in _goals_once(scenes):
        goal = describe_goal(episode.goal.as_mapping())
        if words.literals and episode.goal not in words.literals:
            report.unstated[goal] = None
            continue
        try:
            instruction = _explicit(episode, words)
        except InvalidValueError as error:
            report.broken[str(error).rstrip(".")] = None
            continue
        text = instruction.text
        meant = understood_goals(instruction, episode)
        if not meant or not all(is_right(other, episode) for other in meant):
            report.broken[f"says {text!r} of the goal {goal}, and of others or none"] = None
        said.add(episode.goal)
        report.longest = max(report.longest, text, key=tokens_of)
        if text not in report.renderings and len(report.renderings) < SHOWN:
            report.renderings.append(text)
    report.goals = len(said)
    longest = report.longest
    if tokens_of(longest) > USUAL_LIMIT:
        tokens = tokens_shown(longest)
        report.broken[f"needs {tokens} tokens; only {USUAL_LIMIT} are heard: {longest}"] = None
    if not said:
        report.broken["states no goal of the published scenes"] = None
    return report


def _goals_once(scenes: Iterable[Episode]) -> Iterable[Episode]:
    """Return an episode for each goal and pool, of goals with as many fields as an episode's."""
    found: dict[tuple[Goal, PoolName], Episode] = {}
    for episode in scenes:
        fields, pool = len(goal_fields(episode.goal)), pool_of(episode.split)
        for goal in goals_of(episode):
            if len(goal_fields(goal)) == fields and (goal, pool) not in found:
                found[goal, pool] = with_goal(episode, goal)
    return found.values()


def _explicit(episode: Episode, words: TaskScenarios) -> Instruction:
    """Return what is said of an episode; raises if a command lacks a field."""
    request = request_of(episode, InstructionOptions(language=4))
    if words.literals:
        return spoken_instruction(request, say_literal(request, words.literals))
    return spoken_instruction(request, say_explicit(request, words))

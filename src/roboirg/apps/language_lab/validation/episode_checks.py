"""Check every instruction of an episode with the independent interpreter."""

from __future__ import annotations

import functools
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace

from roboirg.apps.language_lab.validation.leaks import find_leaks
from roboirg.apps.language_lab.validation.validation_results import (
    EpisodeGroup,
    Refusal,
    Rule,
    RuleViolation,
    ValidationResults,
)
from roboirg.core.episode import SPLITS, Episode, Goal, Split, values_in
from roboirg.core.errors import InvalidValueError
from roboirg.core.field_types import check_whole
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import PoolName
from roboirg.language.generator import expressible, find_refusal, instruct_with
from roboirg.language.instruction import Instruction, Mention, hidden_slots
from roboirg.language.settings import ACCEPTANCE_SETTINGS, all_settings, settings_of
from roboirg.language.settings.setting import Instruct, Setting
from roboirg.language.variants import expressible_options
from roboirg.reader import Interpretation, interpret
from roboirg.tasks import get_task, goals_of
from roboirg.tasks.splits.splits import SIZES, get_episode

Read = Callable[[str], Interpretation]
"""Interprets a text in the scene at hand."""
Violation = tuple[Rule, str]
"""A rule and the words that break it."""


EpisodePlace = tuple[str, Split, int]
"""Task, split and position of an episode."""


def places_of(tasks: Sequence[str], splits: Sequence[Split], seeds: int) -> list[EpisodePlace]:
    """Return the places of all episodes of some splits, and of random ones.

    Args:
        tasks: names.
        splits: names.
        seeds: number of random episodes for each task.

    Raises:
        InvalidValueError: the number is negative, or there is nothing to validate.
    """
    check_whole("seeds", seeds, least=0)
    sizes: dict[Split, int] = {**{split: SIZES[split] for split in splits}, "random": seeds}
    found = [
        (task, split, index)
        for task in tasks
        for split, size in sizes.items()
        for index in range(size)
    ]
    if not found:
        raise InvalidValueError("There is nothing to validate: no split and no random seed.")
    return found


def check_place(place: EpisodePlace, pool: PoolName | None = None) -> ValidationResults:
    """Check the episode of a place in the words of a pool; None for those of its split."""
    expected = place[1] in SPLITS
    return check_episode(get_episode(*place), must_be_expressible=expected, pool=pool)


def check_episode(
    episode: Episode, *, must_be_expressible: bool = False, pool: PoolName | None = None
) -> ValidationResults:
    """Check all rules on all instructions of an episode.

    Args:
        episode: of a split or not.
        must_be_expressible: whether the refusal of a setting that selects seeds is a violation.
        pool: of the words; None for that of the split.
    """
    results = ValidationResults()
    # Texts repeat (stages 1 and 5 are the direct ones): read each once.
    read = functools.cache(lambda text: interpret(text, episode.scene, episode.task))
    commands: dict[str, set[str]] = {}
    for options in expressible_options(episode, pool):
        setting = options.setting
        instruction = instruct_with(episode, options)
        results.texts[episode.task, setting] += 1
        violations = list(misread("read back", instruction.text, episode, read))
        if options.form == "implicit" and all_settings()[setting].implicit:
            known = commands.setdefault(setting, set())
            if instruction.command not in known:
                exception = only_candidate(episode, instruction)
                if not known:
                    _count_command(instruction, episode, results, exception=exception)
                known.add(instruction.command)
                violations += not_needed(instruction, episode, read, exception=exception)
                violations += leaking(instruction, episode)
        else:
            violations += misread("self-contained", instruction.command, episode, read)
        _add_violations(results, episode, setting, violations)
    for setting, words in unpaired(episode, expressible(episode, wordings=pool), pool):
        _add_violations(results, episode, setting, [("pairing", words)])
    for setting in settings_of(get_task(episode.task)):
        if all_settings()[setting].may_refuse:
            _count_refusals(all_settings()[setting], episode, pool, results)
        reason = find_refusal(episode, InstructionOptions(setting))
        if reason is not None and must_be_expressible and setting in ACCEPTANCE_SETTINGS:
            _add_violations(results, episode, setting, [("expressible", reason)])
    return results


def misread(rule: Rule, words: str, episode: Episode, read: Read) -> Iterator[Violation]:
    """Yield words unless they read as exactly the goal and are understood to the end.

    Args:
        rule: "read back" of a prompt, "self-contained" of an explicit or resolved command.
        words: the prompt, or the command on its own.
        episode: its episode.
        read: the interpreter.
    """
    found = read(words)
    if found.goals != (episode.goal,) or found.not_understood:
        yield rule, "; the interpreter ".join([words, *found.not_understood])


def not_needed(
    instruction: Instruction, episode: Episode, read: Read, *, exception: bool
) -> Iterator[Violation]:
    """Yield an implicit command that gives the goal on its own, or contradicts it.

    Args:
        instruction: of an implicit form.
        episode: its episode.
        read: the interpreter.
        exception: whether the scene leaves one candidate; the command must then give the goal.
    """
    goals = read(instruction.command).goals
    if episode.goal not in goals or (len(goals) == 1) != exception:
        yield "necessity", instruction.command


def leaking(instruction: Instruction, episode: Episode) -> Iterator[Violation]:
    """Yield an implicit command that contains a hidden value."""
    words = find_leaks(instruction, episode.goal)
    if words:
        yield "no leak", f"{', '.join(sorted(words))} in: {instruction.command}"


def _count_command(
    instruction: Instruction, episode: Episode, results: ValidationResults, *, exception: bool
) -> None:
    pattern = str(instruction.metadata["pattern"] or "")
    group = EpisodeGroup(episode.task, instruction.setting, pattern, episode.difficulty)
    results.commands[group] += 1
    results.exceptions[group] += exception


def _count_refusals(
    setting: Setting, episode: Episode, pool: PoolName | None, results: ValidationResults
) -> None:
    for changes in setting.variants:
        variant = ", ".join(str(value) for value in changes.values())
        group = EpisodeGroup(episode.task, setting.name, variant, episode.difficulty)
        options = replace(InstructionOptions(setting.name, wordings=pool), **changes)
        reason = find_refusal(episode, options)
        results.scenes[group] += 1
        results.refused[group] += reason is not None
        if reason is not None:
            results.reasons[Refusal(setting.name, reason)] += 1


def _add_violations(
    results: ValidationResults, episode: Episode, setting: str, violations: list[Violation]
) -> None:
    results.failures += [
        RuleViolation(rule, episode.task, setting, episode.key, episode.seed, words)
        for rule, words in violations
    ]


def only_candidate(episode: Episode, instruction: Instruction) -> bool:
    """Return whether the scene leaves one goal with the values that the command states.

    It does if all cubes have the same color, and only the color is hidden. In BinFill it also does
    if only one choice of colors has enough cubes, or if the goal wants all colors in equal numbers.
    """
    stated = frozenset(episode.goal.as_mapping()) - hidden_slots(instruction, episode.goal)
    candidates = goals_of(episode)
    wanted = _contents(episode.goal, stated)
    return sum(_contents(goal, stated) == wanted for goal in candidates) == 1


def _contents(goal: Goal, slots: Collection[str]) -> Mapping[str, Counter[str]]:
    """Return the values of some slots, in any order."""
    return {
        slot: Counter(map(str, values_in(value))) for slot, value in goal.slots if slot in slots
    }


def unpaired(
    episode: Episode, settings: Sequence[str], pool: PoolName | None = None
) -> Iterator[tuple[str, str]]:
    """Yield settings whose words differ from their counterpart, each with the difference.

    Args:
        episode: what to say.
        settings: names.
        pool: of the words; None for that of the split.
    """

    def say(options: InstructionOptions) -> Instruction:
        return instruct_with(episode, replace(options, wordings=pool))

    for name in settings:
        for complaint in all_settings()[name].pairing_rules(say):
            yield name, complaint
        options = InstructionOptions(name, wordings=pool)
        if find_refusal(episode, options) is None:
            yield from ((name, complaint) for complaint in _differences(options, say))


def _differences(options: InstructionOptions, say: Instruct) -> Iterator[str]:
    """Yield how the forms of an instruction differ, apart from their references."""
    implicit, resolved = say(options), say(replace(options, form="resolved"))
    if implicit.turns[:-1] != resolved.turns[:-1]:
        yield "resolved, its context differs"
    if without_references(implicit) != without_references(resolved):
        yield "resolved, more than its references differ"
    if all_settings()[options.setting].implicit and implicit.command == resolved.command:
        yield "resolved, its command is still the implicit one"
    if any(mention.role == "anaphor" for mention in _command_mentions(resolved)):
        yield "resolved, its command still points back"


def without_references(instruction: Instruction) -> str:
    """Return the command with a mark in the place of every mention."""
    text = instruction.command
    for mention in reversed(_command_mentions(instruction)):
        text = f"{text[: mention.start]}@{text[mention.end :]}"
    text = re.sub(r"@ (up|down)\b", r"\1 @", text)  # "pick it up", "pick up the red cube"
    return re.sub(r"@(?:(?:,| and|) @)+", "@", text)  # "exactly those", "two red cubes and one ..."


def _command_mentions(instruction: Instruction) -> list[Mention]:
    last = len(instruction.utterances) - 1
    return [mention for mention in instruction.mentions if mention.utterance == last]

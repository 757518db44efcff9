"""Validation can fail: every rule notices words that break it."""

import dataclasses
import io
from collections import Counter

import pytest
from language_variants import without_landmark
from rich.console import Console

from roboirg.apps.language_lab.validation import episode_checks
from roboirg.apps.language_lab.validation.episode_checks import (
    check_episode,
    check_place,
    leaking,
    misread,
    not_needed,
    places_of,
)
from roboirg.apps.language_lab.validation.leaks import find_leaks
from roboirg.apps.language_lab.validation.validation_results import RuleViolation, ValidationResults
from roboirg.apps.language_lab.validation.validation_tables import validation_tables
from roboirg.core.episode import SPLITS
from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import counted
from roboirg.language import FORMS, Utterance, expressible, instruct, instruct_with
from roboirg.reader import interpret
from roboirg.tasks import all_tasks, every_task, get_task, with_goal
from roboirg.tasks.splits.splits import SIZES, get_episode, slot_seed
from roboirg.util.parallel_map import parallel_map

EPISODE = get_episode("PickXtimes", "test", 3)


def read(text):
    return interpret(text, EPISODE.scene, EPISODE.task)


def commanding(instruction, command):
    """The instruction with other words for its command."""
    last = Utterance("command", command)
    return dataclasses.replace(
        instruction, utterances=(*instruction.utterances[:-1], last), mentions=()
    )


def another_goal():
    goals = get_task(EPISODE.task).goals(EPISODE.scene)
    return next(goal for goal in goals if goal != EPISODE.goal)


def test_another_goal_is_not_read_back():
    said = instruct(EPISODE, "direct")
    assert not list(misread("read back", said.text, EPISODE, read))
    assert list(misread("read back", "I like it. Hello there.", EPISODE, read))
    other = dataclasses.replace(EPISODE, goal=another_goal())
    assert list(misread("read back", said.text, other, read)) == [("read back", said.text)]


def test_an_implicit_command_is_not_self_contained():
    implicit, resolved = (instruct(EPISODE, "direct", form).command for form in FORMS)
    assert list(misread("self-contained", implicit, EPISODE, read))
    assert not list(misread("self-contained", resolved, EPISODE, read))


def test_a_command_that_says_all_does_not_need_its_introduction():
    said = instruct(EPISODE, "direct")
    assert not list(not_needed(said, EPISODE, read, exception=False))
    assert list(not_needed(said, EPISODE, read, exception=True))
    telling = commanding(said, instruct(EPISODE).command)
    assert list(not_needed(telling, EPISODE, read, exception=False))
    contradicting = dataclasses.replace(EPISODE, goal=another_goal())
    assert list(not_needed(telling, contradicting, read, exception=True))


@pytest.mark.parametrize("setting", ["direct", "reasoning", "contextual", "spatial"])
def test_a_command_that_says_all_leaks(setting):
    said = instruct(EPISODE, setting)
    assert not list(leaking(said, EPISODE))
    ((rule, words),) = leaking(commanding(said, instruct(EPISODE).command), EPISODE)
    assert rule == "no leak"
    if setting == "spatial":
        placed = instruct(EPISODE, setting, "resolved").command
        assert list(leaking(commanding(said, placed), EPISODE))
    assert " in: " in words


def test_every_color_and_number_of_repetitions_leaks():
    for goal in get_task(EPISODE.task).goals(EPISODE.scene):
        stated = with_goal(EPISODE, goal)
        telling = commanding(instruct(stated, "direct"), instruct(stated).command)
        assert len(find_leaks(telling, goal)) == 2, telling.command


def test_a_value_behind_several_pointers_leaks():
    episode = get_episode("VideoUnmask", "test", 3)
    said = instruct(episode, "direct")
    last = Utterance("command", said.command.replace("second one.", "second one in red."))
    telling = dataclasses.replace(said, utterances=(*said.utterances[:-1], last))
    assert find_leaks(telling, episode.goal) == {"red"}


@pytest.mark.parametrize(
    ("setting", "form", "changed", "complaint"),
    [
        ("contextual", "implicit", 0, "introduction or command"),
        ("contextual", "implicit", -1, "introduction or command"),
        ("direct", "resolved", -1, "is not the explicit one"),
        ("spatial", "resolved", 0, "its context differs"),
        ("reasoning", "resolved", -1, "more than its references"),
    ],
)
def test_other_words_are_not_paired(monkeypatch, setting, form, changed, complaint):
    def changing(episode, options):
        said = instruct_with(episode, options)
        if (options.setting, options.form) != (setting, form):
            return said
        turns = list(said.utterances)
        turns[changed] = Utterance(turns[changed].stage, f"Well, {turns[changed].text}")
        return dataclasses.replace(said, utterances=tuple(turns), mentions=())

    assert not list(episode_checks.unpaired(EPISODE, expressible(EPISODE)))
    monkeypatch.setattr(episode_checks, "instruct_with", changing)
    found = list(episode_checks.unpaired(EPISODE, expressible(EPISODE)))
    assert any(one == setting and complaint in words for one, words in found)


def test_a_resolved_form_that_resolves_nothing_is_noticed(monkeypatch):
    def lazy(episode, options):
        return instruct_with(episode, dataclasses.replace(options, form="implicit"))

    monkeypatch.setattr(episode_checks, "instruct_with", lazy)
    complaints = " ".join(
        words for _, words in episode_checks.unpaired(EPISODE, expressible(EPISODE))
    )
    assert "still the implicit one" in complaints
    assert "still points back" in complaints


def test_scenes_without_landmark_are_counted_and_fail_only_in_splits(monkeypatch):
    lacking = without_landmark(get_episode("PickXtimes", "test", 2))
    found = check_episode(lacking)
    assert not found.failures
    assert found.refused["PickXtimes", "spatial", "robot", lacking.difficulty] == 1
    assert "explicit" not in {one.setting for one in found.scenes}
    refusal = next(one for one in found.reasons if one.setting == "spatial")
    count = found.refused["PickXtimes", "spatial", "robot", lacking.difficulty]
    count += found.refused["PickXtimes", "spatial", "camera", lacking.difficulty]
    assert found.reasons[refusal] == count == 2
    monkeypatch.setattr(episode_checks, "get_episode", lambda *_: lacking)
    strict = check_place(("PickXtimes", "test", 2))
    (failure,) = strict.failures
    assert (failure.rule, failure.words) == ("expressible", refusal.reason)
    *_, table = validation_tables(found)
    assert f"spatial: {refusal.reason}: {counted(count, 'refusal')}" in str(table.caption)


def test_random_scenes_are_not_those_of_the_splits():
    for task in every_task().values():
        last = max(slot_seed(task, split, SIZES[split]) for split in SPLITS)
        assert last < slot_seed(task, "random", 0)


def test_processes_find_what_one_finds():
    work = places_of(("StopCube", "VideoUnmask"), (), 2)
    found = []
    for workers in (0, 1):
        total = ValidationResults()
        for _, evidence in parallel_map(check_place, work, workers):
            total.add(evidence)
        found.append(total)
    assert found[0] == found[1]
    assert found[0].texts["VideoUnmask", "contextual"] == 2 * 16
    assert found[0].texts["VideoUnmask", "direct-rival"] == 2 * 2


def test_every_episode_is_validated_once():
    work = places_of(("PickXtimes",), ("test", "train"), 120)
    assert len(set(work)) == len(work) == 50 + 100 + 120
    assert Counter(split for _, split, _ in work) == {"test": 50, "train": 100, "random": 120}
    for seeds in (-1, 0):
        with pytest.raises(InvalidValueError):
            places_of(("PickXtimes",), (), seeds)


def printed(found: ValidationResults, width: int) -> str:
    console = Console(width=width, file=io.StringIO())
    for table in validation_tables(found):
        console.print(table)
    return console.file.getvalue()


def test_the_tables_are_whole_at_80_columns(snapshot):
    found = ValidationResults()
    for task in sorted(all_tasks()):
        found.add(check_place((task, "test", 3)))
    found.add(check_place(("BinFill", "test", 0)))
    text = printed(found, width=80)
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= 80
    assert text == snapshot
    found.failures.append(
        RuleViolation("no leak", "PickXtimes", "direct", "PickXtimes/test/3", 1, "one")
    )
    assert "(1 broken)" in printed(found, width=150)

"""The combinations of language options that a task offers."""

from collections import Counter

import pytest
from language_variants import expressible_options

from roboirg.language import plain_settings
from roboirg.language.settings import settings_of
from roboirg.tasks import all_tasks, every_task
from roboirg.tasks.splits.splits import get_episode

each_task = pytest.mark.parametrize("task", every_task())


def test_tasks_and_settings_give_the_51_pairs_of_the_paper():
    """Each of the 11 tasks has four settings; 7 tasks have places to name, and also *spatial*."""
    pairs = Counter()
    for task in all_tasks().values():
        pairs.update(plain_settings(task))

    assert pairs == {"explicit": 11, "direct": 11, "reasoning": 11, "contextual": 11, "spatial": 7}


def options_by_setting(task):
    """Count the combinations of options with which a task's first test episode can be said."""
    return Counter(said.setting for said in expressible_options(get_episode(task, "test", 0)))


@each_task
def test_a_task_offers_every_combination_of_language_options(task):
    """In two forms each: three settings; eight kinds of contextual dialogues, by stages and kind
    of distractor; spatial in two frames, where the task has it."""
    expected = {"explicit": 2, "direct": 2, "reasoning": 2, "contextual": 16}
    if "spatial" in settings_of(every_task()[task]):
        expected["spatial"] = 4

    found = options_by_setting(task)

    assert {setting: found[setting] for setting in expected} == expected


@each_task
def test_the_two_harder_settings_are_offered_in_both_forms_or_not_at_all(task):
    """A scene may lack a second value, or anything to see that singles one out."""
    found = options_by_setting(task)

    assert found["direct-rival"] in (0, 2)
    assert found["grounded"] in (0, 2)
    assert found.keys() <= {*plain_settings(), "direct-rival", "grounded"}

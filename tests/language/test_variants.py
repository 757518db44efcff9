"""The variants, counted from the registry."""

from collections import Counter

import pytest

from roboirg.language import plain_settings, variants
from roboirg.language.settings import settings_of
from roboirg.tasks import all_tasks, every_task
from roboirg.tasks.splits.splits import get_episode


def test_tasks_and_settings_give_the_51_pairs_of_the_paper():
    """A setting is a way of speaking; all tasks have four, seven tasks also have *spatial*."""
    found = [setting for task in all_tasks().values() for setting in plain_settings(task)]
    # The paper's numbers: four settings of 11 tasks, and spatial of 7.
    assert [found.count(setting) for setting in plain_settings()] == [11, 11, 11, 11, 7]


@pytest.mark.parametrize("task", every_task())
def test_a_task_offers_every_combination_of_language_options_once(task):
    """6 without context, 16 with distracting remarks, and 4 of places where the task has them."""
    told = list(variants.expressible_options(get_episode(task, "test", 0)))

    assert len(set(told)) == len(told)
    counts = Counter(options.setting for options in told)
    # A scene may lack a second value, or anything to see that singles one out.
    assert counts.pop("direct-rival", 0) in (0, 2)
    assert counts.pop("grounded", 0) in (0, 2)
    assert counts.keys() <= set(plain_settings())
    spatial = 4 if "spatial" in settings_of(every_task()[task]) else 0
    assert counts.total() == 6 + 16 + spatial

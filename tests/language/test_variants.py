"""The variants, counted from the registry."""

from roboirg.language import plain_settings, variants
from roboirg.language.settings import settings_of
from roboirg.tasks import all_tasks, every_task
from roboirg.tasks.splits.splits import get_episode


def test_the_registry_yields_forty_variants():
    found = [setting for task in all_tasks().values() for setting in plain_settings(task)]
    # The paper's numbers.
    assert [found.count(setting) for setting in plain_settings()] == [11, 11, 11, 11, 7]


def test_every_combination_of_options_is_there():
    for name, task in every_task().items():
        told = list(variants.expressible_options(get_episode(name, "test", 0)))
        assert len(set(told)) == len(told)
        plain = [one for one in told if one.setting in plain_settings()]
        spatial = 4 if "spatial" in settings_of(task) else 0
        assert len(plain) == 6 + 16 + spatial
        # A scene may lack a second value, or anything to see that singles one out.
        others = [one for one in told if one not in plain]
        assert {one.setting for one in others} <= {"direct-rival", "grounded"}
        for setting in ("direct-rival", "grounded"):
            assert sum(one.setting == setting for one in others) in (0, 2)

"""Results in the file format of model repositories at Hugging Face."""

import pytest
import yaml
from flat_jobs import frame_of, make_results

from roboirg.apps.leaderboard.hub_results import hub_results
from roboirg.core.errors import InvalidValueError
from roboirg.language.settings import settings_of
from roboirg.tasks import all_tasks


def results_of(setting, outcomes="11", **fields):
    """Return results in each task that has the setting; a letter is an episode's outcome."""
    results = []
    for name, task in all_tasks().items():
        if setting in settings_of(task):
            results += make_results(outcomes, setting, task=name, **fields)
    return results


def values_of(*results):
    """Return the values in the file for some results, by task of the hub's leaderboards."""
    entries = yaml.safe_load(hub_results(frame_of(*results), "someone/data"))
    return {entry["dataset"]["task_id"]: entry["value"] for entry in entries}


def test_models_are_ranked_by_the_mean_of_two_settings_and_shown_in_each():
    """In each task 3 of 5 in spatial, and 1 of 5 in grounded: (60 % + 20 %) / 2."""
    values = values_of(results_of("spatial", "11100"), results_of("grounded", "00001"))

    assert values == {"spatial-and-grounded": 40.0, "spatial": 60.0, "grounded": 20.0}


@pytest.mark.parametrize(
    "fields",
    [{"split": "val"}, {"wordings": "train"}, {"privileged": True}, {"outcomes": "1!"}],
)
def test_results_that_no_leaderboard_can_rank_are_refused(fields):
    """Of other episodes or words, of who reads the simulator's state, or incomplete."""
    with pytest.raises(InvalidValueError):
        values_of(results_of("spatial", **fields), results_of("grounded", **fields))

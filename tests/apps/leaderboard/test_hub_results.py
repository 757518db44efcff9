"""Results in the file format of model repositories at Hugging Face."""

import pytest
import yaml
from flat_jobs import frame_of, make_results

from roboirg.apps.leaderboard.hub_results import hub_results
from roboirg.core.errors import InvalidValueError
from roboirg.language.settings import settings_of
from roboirg.tasks import all_tasks


def results_of(setting, outcomes, **fields):
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
    """Of 50 episodes 30 in spatial and 10 in grounded: (60 % + 20 %) / 2. Explicit is in no mean."""
    values = values_of(
        results_of("explicit", "1" * 50),
        results_of("spatial", "11100" * 10),
        results_of("grounded", "00001" * 10),
    )

    assert values == {
        "spatial-and-grounded": 40.0, "explicit": 100.0, "spatial": 60.0, "grounded": 20.0,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("grounded", "fields"),
    [
        ("1" * 50, {"split": "val"}),
        ("1" * 50, {"wordings": "train"}),
        ("1" * 50, {"privileged": True}),
        ("1" * 49 + "!", {}),
        ("1" * 49, {}),
    ],
)
def test_results_that_no_leaderboard_can_rank_are_refused(grounded, fields):
    """Of other episodes or words, of who reads the simulator's state, or of too few episodes."""
    spatial = results_of("spatial", "1" * 50, **fields)

    with pytest.raises(InvalidValueError):
        values_of(spatial, results_of("grounded", grounded, **fields))

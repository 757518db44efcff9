"""Results in the file format of model repositories at Hugging Face."""

import pytest
import yaml
from flat_jobs import frame_of, make_results

from roboirg.apps.leaderboard.hub_results import hub_results
from roboirg.core.errors import InvalidValueError


def values_of(*results):
    """Return the values in the file for some results, by task of the hub's leaderboards."""
    entries = yaml.safe_load(hub_results(frame_of(*results), "someone/data"))
    return {entry["dataset"]["task_id"]: entry["value"] for entry in entries}


def test_models_are_ranked_by_the_mean_of_two_settings_and_shown_in_each():
    """3 of 4 and 1 of 4 successes: (75 % + 25 %) / 2. Explicit is in no mean."""
    values = values_of(
        make_results("1111", "explicit"),
        make_results("1110", "spatial"),
        make_results("0001", "grounded"),
    )

    assert values == {
        "spatial-and-grounded": 50.0, "explicit": 100.0, "spatial": 75.0, "grounded": 25.0,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("grounded", "fields"),
    [
        ("11", {"split": "val"}),
        ("11", {"wordings": "train"}),
        ("11", {"privileged": True}),
        ("1!", {}),
    ],
)
def test_results_that_no_leaderboard_can_rank_are_refused(grounded, fields):
    """Of other episodes or words, of who reads the simulator's state, or incomplete."""
    spatial = make_results("11", "spatial", **fields)

    with pytest.raises(InvalidValueError):
        values_of(spatial, make_results(grounded, "grounded", **fields))

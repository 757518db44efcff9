"""Honest runs of policies that fail, at once or later, hold."""

import pytest

from roboirg.apps.leaderboard.run_verification import verify_run
from roboirg.records.store import read_records
from roboirg.runs.plan.plan import Plan
from roboirg.runs.run.executor import InProcess, LocalProcesses
from roboirg.runs.run.runner import episode_runner, run_plan

pytestmark = pytest.mark.sim

# Classes of failing_policies: what they do, when, and at which call.
RAISING = ("Posing", "Exits", "Raises_init_1", "Raises_reset_1", "Raises_act_1", "Raises_act_2")
GIVING_NO_ACTIONS = ("Nan_1", "Nan_2", "Narrow_1", "Narrow_2", "Text_1", "Text_2", "Empty_1",
                     "Empty_2", "Half_1", "Half_2")  # fmt: skip
PLAYING_TO_THE_END = ("Raises_hear_1", "Raises_usage_1", "Raises_close_1", "Beyond_1", "Beyond_2")
"""In an episode without a second utterance; targets beyond the joints' limits are clipped."""


def play(folder, names, executor, **options):
    """Play six steps of an episode by each policy, which are classes of failing_policies.py."""
    plan = Plan.model_validate(
        {
            "policies": [f"failing_policies:{name}" for name in names],
            "tasks": "StopCube",
            "settings": "contextual",
            "delivery": "turns",
            "max_steps": 6,
            "episodes": "1",
            "tries": 1,
            **options,
        }
    )
    # Some policies fail when they are made, so `make_plan` would refuse them.
    run_plan(plan, folder, episode_runner(plan, folder), executor)


@pytest.fixture(scope="module")
def in_process(tmp_path_factory):
    """Return the folder of a run of the policies that leave this process alive."""
    folder = tmp_path_factory.mktemp("in_process")
    names = RAISING + GIVING_NO_ACTIONS + PLAYING_TO_THE_END
    play(folder, names, InProcess(), policy_process="shared")
    return folder


def records_by_class(folder):
    """Return the records by the name of the policy's class."""
    return {record.policy.partition(":")[2]: record for record in read_records(folder)}


def test_the_record_has_the_kind_of_error_that_ended_the_episode(in_process):
    """Policies of three lists were played: those that raise or exit, those that give no actions,
    the rest. A name has what a class does and in which call, as `Raises_act_2`. The rest reach the
    end of the episode, so their records have no error.
    """
    errors = {name: record.error for name, record in records_by_class(in_process).items()}

    assert errors == {
        **dict.fromkeys(RAISING, "policy"),
        **dict.fromkeys(GIVING_NO_ACTIONS, "invalid_action"),
        **dict.fromkeys(PLAYING_TO_THE_END, None),
    }


@pytest.mark.parametrize(
    ("name", "steps"), [("Raises_act_1", 0), ("Raises_act_2", 1), ("Posing", 2)]
)
def test_the_actions_before_an_error_are_kept(name, steps, in_process):
    """Steps are those before the call that raises: the first, second and third (`Posing`) of `act`.

    An action is one step here.
    """
    record = records_by_class(in_process)[name]

    assert record.steps == steps
    assert record.action_log is not None


def test_a_run_of_policies_that_fail_in_this_process_holds(in_process):
    """Six policies raise or exit and ten give no actions, so that 16 records have an error.

    To play the run again confirms all of them.
    """
    found = verify_run(in_process, workers=1)

    assert found.holds, found
    assert found.errors == 6 + 10  # raising, and giving no actions


@pytest.mark.slow
def test_a_run_of_policies_whose_process_ends_holds(tmp_path):
    """Policies end their process (Die), kill it, or sleep in it for an hour (they have 30 s), in
    `reset` or in `act`. An exit is the policy's own error; a signal may be the machine's, as when
    memory runs out.

    To verify is to check the records and to play the actions that were made before.
    """
    expected = {
        "Die_reset": "policy",
        "Die_act": "policy",
        "Kill_reset": "infrastructure",
        "Kill_act": "infrastructure",
        "Sleep_reset": "timeout",
        "Sleep_act": "timeout",
    }
    play(tmp_path, expected, LocalProcesses(1), policy_timeout_s=30.0)

    found = verify_run(tmp_path)

    assert found.holds, found
    assert {name: record.error for name, record in records_by_class(tmp_path).items()} == expected

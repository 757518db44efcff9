"""Honest runs of policies that fail, at once or later, hold."""

import failing_policies
import pytest
from failing_policies import HOSTED, IN_PROCESS

from roboirg.apps.leaderboard.run_verification import verify_run
from roboirg.records.store import read_records
from roboirg.runs.plan.plan import Plan
from roboirg.runs.run.executor import InProcess, LocalProcesses
from roboirg.runs.run.runner import episode_runner, run_plan

pytestmark = pytest.mark.sim


def play(folder, names, executor, **options):
    specs = [f"failing_policies:{name}" for name in names]
    chosen = {"tasks": "StopCube", "settings": "contextual", "delivery": "turns", "max_steps": 6,
              "episodes": "1", "tries": 1}  # fmt: skip
    # Not opened: some fail when they are made.
    plan = Plan.model_validate({"policies": specs, **chosen, **options})
    run_plan(plan, folder, episode_runner(plan, folder), executor)


def test_runs_of_policies_that_fail_in_this_process_hold(tmp_path):
    assert failing_policies.Failing

    play(tmp_path, IN_PROCESS, InProcess(), policy_process="shared")
    records = {record.policy.partition(":")[2]: record for record in read_records(tmp_path)}
    assert len(records) == len(IN_PROCESS) >= 20
    assert {record.outcome for record in records.values()} == {"error", "failure"}
    assert records["Raises_act_1"].action_log is not None
    assert (records["Posing"].outcome, records["Posing"].steps) == ("error", 2)

    found = verify_run(tmp_path, workers=1)
    assert found.holds, found
    assert found.errors == sum(record.outcome == "error" for record in records.values())


@pytest.mark.slow
def test_runs_of_policies_whose_process_ends_hold(tmp_path):
    play(tmp_path, HOSTED, LocalProcesses(1), policy_timeout_s=30.0)
    records = read_records(tmp_path)
    assert {record.error for record in records} == {"policy", "infrastructure", "timeout"}

    found = verify_run(tmp_path)
    assert found.holds, found

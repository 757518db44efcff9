"""Which of a run's records is played again."""

from types import SimpleNamespace

import pytest
from made_records import make_record
from page_text import store

from roboirg.apps.demonstrations.recorded_policy import RecordedPolicy
from roboirg.evaluation.plan.plan import Plan
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.language import instruct
from roboirg.tasks.splits.splits import get_episode

EPISODE = get_episode("PickXtimes", "test", 0)
PLAN = Plan(
    policies=("listener", "random"), tasks=(EPISODE.task,), settings=("direct", "explicit"),
    episodes=(0, 1),
)  # fmt: skip
OUTCOMES = ("success", "success", "success", "success", "success", "failure", "success", "success")


@pytest.mark.parametrize(
    ("setting", "policy", "number"),
    [("explicit", None, 1), ("reasoning", None, 4), ("direct", "listener", 0),
     ("explicit", "random", 4)],
)  # fmt: skip
def test_the_newest_success_is_played_best_in_the_setting_that_is_said(
    tmp_path, setting, policy, number
):
    jobs = zip(PLAN.jobs(), OUTCOMES, strict=True)
    store(tmp_path, [
        make_record(job, outcome, action_log=str(place) * 64)
        for place, (job, outcome) in enumerate(jobs)
    ])  # fmt: skip
    again = RecordedPolicy(tmp_path, policy)
    said = instruct(EPISODE, setting)
    again.attach(SimpleNamespace(episode=EPISODE, instruction=said))
    again.reset(said.text, {})
    with pytest.raises(StoreError, match=str(number) * 64):
        again.act({})

"""How a planner failed, told from its record alone; tests/policies plays such episodes."""

from __future__ import annotations

import pytest
from made_records import make_record
from msgspec.structs import replace

from roboirg.analysis.measures.planner_failures import IDLE_STEPS, planner_failure
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.subgoal_text import UNKNOWN_WORDS
from roboirg.records.record import Attribution, Job, Record, SubgoalRecord

WRONG = Attribution(kind="grounding", failure="wrong_object", sentence="It took another one.")

UNCLEAR = Attribution(kind="undecided", failure="ambiguous_act", sentence="It closed its fingers.")


@pytest.fixture(scope="module")
def failed() -> Record:
    options = InstructionOptions("explicit")
    job = Job(policy="random", task="PickXtimes", split="test", episode=0, options=options)
    record = make_record(job, "failure", "no")
    return replace(record, policy_metadata={"planner": "made up"}, attribution=None)


@pytest.mark.parametrize(
    ("verdicts", "attribution", "named"),
    [
        ("right", WRONG, "wrong thing"),
        ("wrong_place", UNCLEAR, "wrong place"),
        ("wrong_place wrong_count right", None, "wrong count"),
        ("right", None, "hands"),
    ],
)
def test_the_act_that_ended_the_episode_names_the_failure(failed, verdicts, attribution, named):
    """Or else the last wrong subgoal, as those before it were corrected."""
    said = [
        SubgoalRecord(step=5, text="pick it up", verdict=verdict) for verdict in verdicts.split()
    ]
    record = replace(failed, steps=9, subgoals=tuple(said), attribution=attribution)

    assert planner_failure(record) == named
    assert planner_failure(replace(record, policy_metadata={}, subgoals=())) is None


@pytest.mark.parametrize(
    ("ended", "why", "ago", "named"),
    [
        ("refused", UNKNOWN_WORDS, 9, "unreadable"),
        ("refused", "it fits two things", 9, "refused"),
        ("done", None, 9, "went on too long"),
        ("done", None, IDLE_STEPS + 1, "stopped early"),
        (None, None, IDLE_STEPS, "went on too long"),
        ("failed", None, 9, "hands"),
    ],
)
def test_the_last_subgoal_names_it_when_time_is_up(failed, ended, why, ago, named):
    """Whatever replies could not be read before it."""
    steps = failed.environment.max_steps
    said = SubgoalRecord(
        step=steps - ago, text="pick up the cube", verdict="right", ended=ended, why=why
    )
    usage = {"unparsed": 2.0}

    record = replace(failed, steps=steps, subgoals=(said,), attribution=WRONG, usage=usage)

    assert planner_failure(record) == named

"""How a planner failed, told from its record alone; tests/policies plays such episodes."""

from __future__ import annotations

import pytest
from made_records import make_record
from msgspec.structs import replace

from roboirg.analysis.measures.planner_failures import IDLE_STEPS, planner_failure
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import make_frame
from roboirg.analysis.tables.subgoal_table import make_subgoal_table
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.subgoal_text import UNKNOWN_WORDS
from roboirg.records.record import Attribution, Job, SubgoalRecord

TOOK_THE_WRONG_THING = Attribution(
    kind="grounding", failure="wrong_object", sentence="It took another one."
)

MEANING_OF_THE_ACT_IS_UNCLEAR = Attribution(
    kind="undecided", failure="ambiguous_act", sentence="It closed its fingers."
)


@pytest.fixture(scope="module")
def failed_record_of_a_planner():
    """A record that still lacks subgoals and the cause of the failure."""
    options = InstructionOptions("explicit")
    job = Job(policy="random", task="PickXtimes", split="test", episode=0, options=options)
    record = make_record(job, "failure", "no")
    return replace(record, policy_metadata={"planner": "made up"}, attribution=None)


@pytest.mark.parametrize(
    ("verdicts", "attribution", "named"),
    [
        (["right"], TOOK_THE_WRONG_THING, "wrong thing"),
        (["wrong_place"], MEANING_OF_THE_ACT_IS_UNCLEAR, "wrong place"),
        (["wrong_place", "wrong_count", "right"], None, "wrong count"),
        (["right"], None, "hands"),
    ],
)
def test_a_planners_failure_is_named_by_the_wrong_act_or_else_by_its_last_wrong_subgoal(
    failed_record_of_a_planner, verdicts, attribution, named
):
    """Subgoals are the orders of a planner, each judged by a verdict; the episode failed.

    A wrong thing that was taken names the failure even if all subgoals were right; an act of
    unclear meaning or none names nothing, and then the last wrong verdict does: those before it
    were corrected. If all were right, the hands that carried them out failed.
    """
    subgoals = tuple(
        SubgoalRecord(step=5, text="pick it up", verdict=verdict) for verdict in verdicts
    )
    record = replace(
        failed_record_of_a_planner, steps=9, subgoals=subgoals, attribution=attribution
    )

    assert planner_failure(record) == named


def test_a_failure_of_a_policy_that_is_no_planner_has_no_such_name(failed_record_of_a_planner):
    record = replace(failed_record_of_a_planner, policy_metadata={}, subgoals=())

    assert planner_failure(record) is None


@pytest.mark.parametrize(
    ("ended", "why", "steps_since", "named"),
    [
        ("refused", UNKNOWN_WORDS, 9, "unreadable"),
        ("refused", "it fits two things", 9, "refused"),
        ("done", None, 9, "went on too long"),
        ("done", None, IDLE_STEPS + 1, "stopped early"),
        (None, None, IDLE_STEPS, "went on too long"),
        ("failed", None, 9, "hands"),
    ],
)
def test_an_episode_without_an_end_is_named_by_what_became_of_the_last_subgoal(
    failed_record_of_a_planner, ended, why, steps_since, named
):
    """The episode ran into the step limit, `steps_since` after the last subgoal was given.

    A planner that names nothing more for over `IDLE_STEPS` steps after its subgoal was done stopped
    early. The two replies that could not be read before it do not matter.
    """
    limit = failed_record_of_a_planner.environment.max_steps
    subgoal = SubgoalRecord(
        step=limit - steps_since, text="pick up the cube", verdict="right", ended=ended, why=why
    )
    record = replace(
        failed_record_of_a_planner,
        steps=limit,
        subgoals=(subgoal,),
        attribution=TOOK_THE_WRONG_THING,
        usage={"unparsed": 2.0},
    )

    assert planner_failure(record) == named


def test_what_models_cost_is_in_the_table_of_a_policy_that_names_no_subgoal():
    """A listener that asked a model in two episodes, at a price that is not known.

    It read 1,200.5 tokens in the mean, which is rounded up.
    """
    options = InstructionOptions("explicit")
    job = Job(policy="random", task="PickXtimes", split="test", episode=0, options=options)
    first = make_record(job, "success", None)
    second = make_record(replace(job, episode=1), "success", None)
    records = [
        replace(first, usage={"calls": 4.0, "input_tokens": 1200.0}),
        replace(second, usage={"calls": 1.0, "input_tokens": 1201.0}),
    ]
    data = RunData(make_frame([("run", records)], ()), records)

    table = make_subgoal_table(data)

    cells = {
        column.name: str(entry)
        for column, entry in zip(table.columns, table.rows[0].entries, strict=True)
    }
    assert (cells["subgoals"], cells["calls"], cells["tokens in"]) == ("0", "2.5", "1201")
    assert "US$" not in cells

"""What a policy names as its subgoal: checked, in the record, on the page and in the table."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from made_records import fill, make_record
from msgspec.structs import replace
from page_text import call

import roboirg
from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.subgoal_text import split_point
from roboirg.policies.by_name.finding import read_policy
from roboirg.policies.contract.policy_calls import policy_subgoal
from roboirg.records.record import Job, SubgoalRecord
from roboirg.records.record_codec import StoreError, encode, read_record
from roboirg.runs.play.rollout import EpisodeRunner

JOB = Job(
    policy="random",
    ref=read_policy("random"),
    task="PickXtimes",
    split="test",
    episode=0,
    options=InstructionOptions("direct"),
    environment=EnvironmentOptions(max_steps=30),
)
THREE_SUBGOALS = (
    SubgoalRecord(
        step=0, text="pick up the cube at <3, 4>", point=(3, 4), due="pick it up",
        verdict="wrong_thing",
    ),
    SubgoalRecord(step=16, text="pick it up", due="pick it up", verdict="right"),
    SubgoalRecord(step=32, text="sing", verdict="lost"),
)  # fmt: skip
"""One names a wrong thing, with a point, one is right, and one is no act that was due (lost)."""


def record_with_usage(job, **usage):
    """Return the record of a failure with three subgoals, for which models took this much."""
    return make_record(job, "failure", "no", subgoals=THREE_SUBGOALS, usage=usage)


def printed_subgoals_table(run):
    return call("tables", "--which", "subgoals", "--format", "markdown", run)


@pytest.mark.parametrize("subgoal", [3, b"pick", ["pick"], "x" * 301, "a\nb", "\x1b[2J", "\ud800"])
def test_a_subgoal_that_is_no_short_printable_text_is_refused(subgoal):
    """A policy names its subgoal in an attribute. It must be a text of up to 300 characters without
    line breaks, codes that control a terminal, or half a character (a lone surrogate)."""
    with pytest.raises(InvalidValueError, match="The policy's subgoal"):
        policy_subgoal(SimpleNamespace(subgoal=subgoal))


@pytest.mark.parametrize(
    ("fields", "subgoal"),
    [({}, None), ({"subgoal": ""}, None), ({"subgoal": "x" * 300}, "x" * 300)],
)
def test_a_policy_may_name_no_subgoal_or_one_of_up_to_300_characters(fields, subgoal):
    assert policy_subgoal(SimpleNamespace(**fields)) == subgoal


def test_subgoals_are_read_back_from_a_record():
    """Three subgoals: one of a wrong thing with a point, one that was right, one not understood."""
    record = make_record(JOB, "failure", "no", subgoals=THREE_SUBGOALS)

    assert read_record(encode(record), Path("r"), 1).subgoals == THREE_SUBGOALS


def test_a_record_with_a_subgoal_of_more_than_300_characters_is_refused():
    """Such a record can be written, but is not read again; the message names the field `text`."""
    long = replace(THREE_SUBGOALS[0], text="x" * 301)
    record = make_record(JOB, "failure", "no", subgoals=(long,))

    with pytest.raises(StoreError, match="text"):
        read_record(encode(record), Path("r"), 1)


def test_the_table_counts_how_many_subgoals_were_right_or_wrong_in_which_way(tmp_path):
    """A row counts all subgoals, and the right ones among them, those that name a wrong thing, a
    wrong place or a wrong count, and those that are no act that was due (lost).

    The one episode has three: right, wrong thing and lost, each a third.
    """
    subgoals = (
        SubgoalRecord(step=0, text="pick it up", verdict="right"),
        SubgoalRecord(step=16, text="pick up the ball", verdict="wrong_thing"),
        SubgoalRecord(step=32, text="sing", verdict="lost"),
    )

    run = fill(tmp_path, make_record(JOB, "failure", "no", subgoals=subgoals))
    printed = printed_subgoals_table(run)

    assert "| subgoals | right | wrong thing | wrong place | wrong count | lost |" in printed
    assert "| 3 | 1 (33 %) | 1 (33 %) | 0 (0 %) | 0 (0 %) | 1 (33 %) |" in printed


def test_the_table_has_the_means_of_what_the_calls_of_models_took_in_an_episode(tmp_path):
    """A row ends with the calls of an episode, the seconds until answers, and the seconds of them
    spent in queues.

    The means of two episodes: (3 + 1) / 2 = 2 calls, 6.5 / 2 = 3.25 s until answers, and
    2.25 / 2 = 1.125 s in queues, which is rounded up.
    """
    three_calls = record_with_usage(JOB, calls=3.0, answered_s=6.5, waited_s=2.25)
    one_call = record_with_usage(replace(JOB, episode=1), calls=1.0)

    printed = printed_subgoals_table(fill(tmp_path, three_calls, one_call))

    assert "| calls | s for answers | s in queues |" in printed
    assert "| 2 | 3.25 | 1.13 |" in printed


def test_the_table_has_unknown_costs_where_a_service_did_not_report_all_of_them(tmp_path):
    """In the setting *direct* the one episode tells its calls, its tokens in and out, and its US$,
    which are printed in this order.

    In *contextual* the second of two episodes lacks tokens out and US$. These means are unknown,
    but that of the tokens in is (8 + 4) / 2 = 6.
    """
    usage = {"calls": 1.0, "input_tokens": 8.0, "output_tokens": 2.0, "cost_usd": 0.5}
    direct = record_with_usage(JOB, **usage)
    contextual_job = JOB.with_options(setting="contextual")
    whole = record_with_usage(contextual_job, **usage)
    partly = record_with_usage(replace(contextual_job, episode=1), calls=1.0, input_tokens=4.0)

    printed = printed_subgoals_table(fill(tmp_path, direct, whole, partly))

    assert "| calls | tokens in | tokens out | US$ |" in printed
    assert "| 1 | 8 | 2 | 0.5 |" in printed
    assert "| 1 | 6 | unknown | unknown |" in printed


class PointsAt:
    """Names the same subgoal in each call, at the next of its points; holds still for 10 steps."""

    cameras = ("front",)

    def __init__(self, *points):
        self.points = iter(points)

    def reset(self, instruction, demonstration):
        self.subgoal = None

    def act(self, observation):
        row, column = next(self.points)
        self.subgoal = f"pick up the green cube at <{row}, {column}> for the first time"
        return np.tile([*observation["joint_positions"], 1.0], (10, 1))


@pytest.fixture
def point_of_the_green_cube():
    """Row and column of the cube in the first picture of JOB's episode, as the simulator has it."""
    env = roboirg.make(JOB.task, episode=0, cameras=(), grounded=True)
    _, info = env.reset()
    env.close()
    _, point = split_point(info["grounded_subgoal"])
    return point


@pytest.mark.sim
def test_an_episode_notes_a_subgoal_when_its_point_changes_and_whether_it_is_right(
    monkeypatch, point_of_the_green_cube
):
    """The episode ends after 30 steps. A policy is asked at steps 0, 10 and 20, as it answers for
    10 steps, and each time names the subgoal that is due: to pick up the green cube.

    It points into a corner twice, where there is no cube, and then at the cube, so its subgoal is
    noted as new at steps 0 and 20. The policy is put in the place of the one that the job names.
    """
    policy = PointsAt((0, 0), (0, 0), point_of_the_green_cube)
    monkeypatch.setattr("roboirg.runs.play.rollout.load_policy", lambda prepared: policy)

    record = EpisodeRunner(Path()).play_once(JOB).record

    corner, cube = record.subgoals
    assert (corner.step, corner.point, corner.verdict) == (0, (0, 0), "wrong_thing")
    assert (cube.step, cube.point, cube.verdict) == (20, point_of_the_green_cube, "right")
    assert corner.due == cube.due == "pick up the green cube for the first time"
    assert record.outcome == "failure", record.cause

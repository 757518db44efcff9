"""What a policy names as its subgoal: checked, in the record, on the page and in the table."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from made_records import fill, make_record
from msgspec.structs import replace
from page_text import call, render

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


def printed_subgoals_table(run):
    return call("tables", "--which", "subgoals", "--format", "markdown", run)


@pytest.mark.parametrize("subgoal", [3, b"pick", ["pick"], "x" * 301, "a\nb", "\x1b[2J", "\ud800"])
def test_a_subgoal_that_is_no_short_printable_text_is_refused(subgoal):
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


def test_the_page_shows_which_subgoals_were_wrong_or_unreadable():
    """One named a wrong thing, and one could not be understood (lost)."""
    page = render([make_record(JOB, "failure", "no", subgoals=THREE_SUBGOALS)])

    assert "(wrong thing; due: pick it up)" in page
    assert "sing (lost; due: nothing)" in page


def test_the_table_counts_which_subgoals_were_right_wrong_or_unreadable(tmp_path):
    """Of three subgoals one was right, one named a wrong thing, one could not be understood.

    These are the first, second and last of the counts. Then the means of two episodes: (3 + 1) / 2
    = 2 calls, 6.5 / 2 = 3.25 seconds until the answer, 2.25 / 2 = 1.125 seconds of waiting, which
    is rounded up.
    """
    spent = {"calls": 3.0, "answered_s": 6.5, "waited_s": 2.25}
    record = make_record(JOB, "failure", "no", subgoals=THREE_SUBGOALS, usage=spent)
    other = make_record(replace(JOB, episode=1), "failure", "no", usage={"calls": 1.0})

    printed = printed_subgoals_table(fill(tmp_path, record, other))

    counts = "| 3 | 1 (33 %) | 1 (33 %) | 0 (0 %) | 0 (0 %) | 1 (33 %) |"
    assert f"{counts} 2 | 3.25 | 1.13 |" in printed


def test_the_table_has_unknown_costs_where_a_service_did_not_report_all_of_them(tmp_path):
    """In direct the one episode tells its calls, tokens and US$; they are printed in this order.

    In contextual one of two lacks output tokens and costs: these means are unknown, but that of the
    input tokens is (8 + 4) / 2 = 6.
    """
    known = {"calls": 1.0, "input_tokens": 8.0, "output_tokens": 2.0, "cost_usd": 0.5}
    partly = {"calls": 1.0, "input_tokens": 4.0}
    direct = replace(JOB, options=InstructionOptions("direct"))
    contextual = replace(JOB, options=InstructionOptions("contextual"))
    for job, usage in (
        (direct, known),
        (contextual, known),
        (replace(contextual, episode=1), partly),
    ):
        fill(tmp_path, make_record(job, "failure", "no", subgoals=THREE_SUBGOALS, usage=usage))

    printed = printed_subgoals_table(tmp_path)

    assert "| 1 | 8 | 2 | 0.5 |" in printed
    assert "| 1 | 6 | unknown | unknown |" in printed


class PointsTwice:
    """Points into a corner, then says nothing new, then points at the thing."""

    cameras = ("front",)
    point = (0, 0)

    def reset(self, instruction, demonstration):
        self.calls = 0
        self.subgoal = None

    def act(self, observation):
        row, column = (0, 0) if self.calls < 2 else self.point
        self.subgoal = f"pick up the green cube at <{row}, {column}> for the first time"
        self.calls += 1
        return np.tile([*observation["joint_positions"], 1.0], (10, 1))


@pytest.mark.sim
def test_an_episode_notes_a_subgoal_when_it_changes_with_its_point_and_whether_it_is_right(
    monkeypatch,
):
    """Answers of 10 steps: twice it points into a corner, then at the right cube, at step 20."""
    monkeypatch.setattr("roboirg.runs.play.rollout.load_policy", lambda prepared: PointsTwice())
    env = roboirg.make(JOB.task, episode=0, cameras=(), grounded=True)
    _, info = env.reset()
    _, point = split_point(info["grounded_subgoal"])
    env.close()
    monkeypatch.setattr(PointsTwice, "point", point)
    result, _ = EpisodeRunner(Path()).play_once(JOB)

    assert result.outcome == "failure", result.cause

    words = "pick up the green cube for the first time"
    assert [
        (subgoal.step, subgoal.point, subgoal.due, subgoal.verdict) for subgoal in result.subgoals
    ] == [
        (0, (0, 0), words, "wrong_thing"),
        (20, point, words, "right"),
    ]

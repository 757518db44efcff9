"""Why an episode can fail: the one table of kinds and names.

Rules of tasks, the analysis, records, tables, the page and the documentation read it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

FailureKind = Literal["grounding", "execution", "undecided"]
"""A key of `FAILURE_KINDS`."""
FAILURE_KINDS: Mapping[FailureKind, str] = {
    "grounding": "the policy did something else than the instruction means, or meant to",
    "execution": "it tried what the instruction means, and did not complete it",
    "undecided": "neither what it did nor what it declared shows which of the two it was",
}
"""What each kind means."""

FailureName = Literal[
    "wrong_object",
    "mirrored_pick",
    "wrong_count",
    "wrong_order",
    "wrong_time",
    "wrong_place",
    "misunderstood",
    "other_goal",
    "missed_grasp",
    "missed_press",
    "dropped",
    "misplaced",
    "mistimed",
    "touched_button",
    "out_of_time",
    "not_followed",
    "unreachable",
    "no_attempt",
    "stopped",
    "ambiguous_act",
    "no_answer",
]
"""A key of `FAILURES`."""


class FailureMeaning(NamedTuple):
    """What a name of a failure means.

    Attributes:
        kind: of which kind it is.
        meaning: its definition; the subject is the policy.
        example: one, in words.
    """

    kind: FailureKind
    meaning: str
    example: str


FAILURES: Mapping[FailureName, FailureMeaning] = {
    "wrong_object": FailureMeaning(
        "grounding",
        "handled an object that no stage expects, or another one than the current stage "
        "expects; or tried to, and tried no right one",
        "the green cube instead of the red one; fingers that close six times next to the green one",
    ),
    "mirrored_pick": FailureMeaning(
        "grounding",
        "`wrong_object` or `wrong_place` with exactly the object that the words single out with "
        "left and right exchanged",
        '"the container all the way on the left", and the one all the way on the right is lifted',
    ),
    "wrong_count": FailureMeaning(
        "grounding",
        "did something once too often, or ended the task with acts missing that it had not tried",
        "the button after two cubes instead of three; a third red cube in the bin",
    ),
    "wrong_order": FailureMeaning(
        "grounding",
        "did, or tried, what a later stage expects before the expected act",
        "both right containers, the second first; the left target before the right one",
    ),
    "wrong_time": FailureMeaning(
        "grounding",
        "pressed, or tried to, on another visit than the instruction names",
        "the moving cube stopped on visit 2 instead of 3",
    ),
    "wrong_place": FailureMeaning(
        "grounding",
        "put the right object at, or next to, a place that is not expected",
        "the right cube on another disc",
    ),
    "misunderstood": FailureMeaning(
        "grounding",
        "declared another goal than the one that is meant, or one that the scene cannot have",
        "a listener that names red, once, where green, three times, is meant",
    ),
    "other_goal": FailureMeaning(
        "grounding",
        "in the [control arm](controls.md) `other-goal`: reached the scene's own goal, or did "
        "something first that agrees with it",
        "the words ask for the red cube, it picks the green one, which the scene's own words "
        "ask for",
    ),
    "missed_grasp": FailureMeaning(
        "execution",
        "closed its fingers on nothing next to the right object, or took hold of it, and did "
        "not lift it",
        "the fingers close next to the cube; it slips out before it is up",
    ),
    "missed_press": FailureMeaning(
        "execution",
        "lowered a closed hand next to the right button and did not press it",
        "the hand comes down 5 cm from the button",
    ),
    "dropped": FailureMeaning(
        "execution",
        "let the right object go in the air, wherever it landed",
        "the cube falls on the way to the target",
    ),
    "misplaced": FailureMeaning(
        "execution",
        "put the right object down next to its place, or carried it past that place",
        "the cube is put down next to the target; a swing passes 5 cm from the disc",
    ),
    "mistimed": FailureMeaning(
        "execution",
        "pressed off the target, at most half a pass before or after the middle of the right visit",
        "the moving cube stops just in front of its target",
    ),
    "touched_button": FailureMeaning(
        "execution",
        "pressed a button that was not due with something else than the fingertips of an empty "
        "hand",
        "the forearm on the button; a button touched by the cube in the hand",
    ),
    "out_of_time": FailureMeaning(
        "execution",
        "ran out of time on the way: the hand still moved, and nothing was wrong",
        "the cube still in the hand",
    ),
    "not_followed": FailureMeaning(
        "execution",
        "a planner named what was due, and the hands did something else or nothing",
        "the subgoal names the red cube, the hand takes the green one",
    ),
    "unreachable": FailureMeaning(
        "execution",
        "commanded a pose that the arm cannot reach",
        "an `ee_pose` behind the robot",
    ),
    "no_attempt": FailureMeaning(
        "undecided",
        "tried nothing: no grasp, no press, no way to an expected object",
        "a policy that stands still, or trembles",
    ),
    "stopped": FailureMeaning(
        "undecided",
        "did right what it did, then rested until time was up",
        "the hand above the button, which it never presses",
    ),
    "ambiguous_act": FailureMeaning(
        "undecided",
        "did what can be a slip or a choice",
        "fingers that close between the right cube and another one; a press half to two thirds "
        "of a pass off the right visit",
    ),
    "no_answer": FailureMeaning(
        "undecided",
        "a model that names goals or subgoals gave no readable answer",
        "a reply without a goal, even to a second query",
    ),
}
"""Every name of a failure, by kind, in the order of tables."""

"""Commands of other people are read as they are meant, or refused with a reason."""

import pytest
from goal_text import goal_text

from roboirg.reader import interpret
from roboirg.tasks.splits import get_episode

COMMANDS_WITH_GOALS = [
    ("PickXtimes", "GRAB   THE RED CUBE , put it on the target TWICE and press the button",
     "red 2"),
    ("PickXtimes", "Blue cube -> target, 3x, then button.", "blue 3"),
    ("PickXtimes", "Could you please take the red cube and set it onto the disc once?", "red 1"),
    ("PickXtimes", "Put the red cube on the target, then do it again.", "red 2"),
    ("PickXtimes", "Put the red cube on the target. Repeat it two more times.", "red 3"),
    ("PickXtimes",
     ("1. Pick up the blue cube.\n2. Place it on the target.\n3. Repeat steps 1 and 2 two "
      "more times.\n4. Press the button to finish."), "blue 3"),
    ("PickXtimes", "I slept badly. Put the red cube on the target.", "red 1"),
    ("PickXtimes", "Put the second cube from the left on the target twice.", "green 2"),
    ("PickXtimes", "Put the cube farthest from the robot on the target once.", "red 1"),
    ("PickXtimes", "Put the cube between the red cube and the target on the target once.",
     "green 1"),
    ("PickXtimes", "Put the cube nearest to the cube on the far right on the target once.",
     "green 1"),
    ("SwingXtimes",
     ("Move the red cube to the top of the right-side target, then to the top of the "
      "left-side target, repeating this twice, and put it down."), "red 2"),
    ("StopCube", "Stop it on the target during the 4th visit.", "4"),
    ("StopCube", "Wait until the cube has reached the target for the third time, then press.", "3"),
    ("StopCube", "Let the cube pass the target twice, then stop it the next time.", "3"),
    ("StopCube", "Press the button at its second to last visit.", "4"),
    ("BinFill", "Pick up two green cubes and drop them in the bin.", "green 2"),
    ("BinFill", "Fill the bin with two green cubes and a blue one.", "blue 1 green 2"),
    ("BinFill", "Put a green cube in the bin. Then put another green cube in the bin.", "green 2"),
    ("BinFill", "One of each color into the bin, then button.", "blue 1 green 1"),
    ("VideoUnmask", "Watch the video, then lift the container hiding the red cube.", "red"),
    ("VideoUnmask", "Lift the container over red after the one over blue.", "blue red"),
    ("VideoUnmask", "Lift the container over red, put it down, and then the one over blue.",
     "red blue"),
    ("VideoUnmask", "Lift the container over red, then do the same with the blue one.", "red blue"),
    ("VideoUnmask", "Lift blue's container.", "blue"),
    ("VideoUnmask", "Find the red cube and lift its container.", "red"),
    ("VideoUnmask", "Lift the leftmost container.", "red"),
    ("ButtonUnmaskSwap", "Press one button, press the other button, and uncover the red cube.",
     "red"),
    ("VideoRepick", "Pick the cube you saw in the video up and put it down. Do this twice.", "2"),
    ("VideoPlaceButton", "Put red on the pre-press target.", "red before"),
    ("VideoPlaceButton", "Put the red cube where it was after the button was pressed.",
     "red after"),
    ("VideoPlaceOrder", "Put the red cube on the target where it was the third time.", "red 3"),
    ("VideoPlaceOrder", "Put the blue cube on the last target used in the video.", "blue 3"),
    ("PutInBox", "Put the roll of tape into the left box.", "purple"),
    ("PickByCount", "Move the grey tape to the target two times.", "gray 2"),
]  # fmt: skip
"""Task, command, and the goal: ``red 2`` is the red cube, twice; ``blue red`` blue, then red."""


@pytest.mark.parametrize(("task", "text", "goal"), COMMANDS_WITH_GOALS)
def test_a_typed_command_is_read_as_the_goal_that_a_person_means(task, text, goal):
    """`goal` has its values, for example the color and how often.

    The scene is that of the task's test episode 2. In PickXtimes the blue cube stands on the left,
    the green one in the middle, near the button, and the red one on the right, farthest away.
    """
    scene = get_episode(task, "test", 2).scene

    found = interpret(text, scene, task)

    assert [goal_text(read) for read in found.goals] == [goal]
    assert found.not_understood == ()


@pytest.mark.parametrize(
    ("task", "text", "complaint"),
    [
        ("PickXtimes", "Put it on the target twice.", "points back at"),
        ("PickXtimes", "Put the red cube on the target as often as he did.", "often"),
        ("PickXtimes", "Put the red cube on the target two more times.", "how often"),
        ("PickXtimes", "Put the red cube on the target twice, three times.", '"2 and 3"'),
        ("PickXtimes", "Put the red cube on the target twice. No, the blue one.", '"no"'),
        ("PickXtimes", "Put the red cube on the target and press the button three times.",
         "how often to press"),
        ("PickXtimes", "Put the red cube on the target. Press the button. Repeat three times.",
         "what to repeat"),
        ("PickXtimes", "I count to two. Put the red cube on the target.", "leaves repeats open"),
        ("PickXtimes", "Put the red cube next to the button.", "where to put"),
        ("PickXtimes", "Put the red cube on the target before the press.", "which target"),
        ("PickXtimes", "Put the red cube on the left on the target once.", "nothing to handle"),
        ("SwingXtimes", "Swing the red cube from the left to the right target once.", "the way"),
        ("StopCube", "Stop the cube on the target.", "leaves visit open"),
        ("StopCube", "Press the button at the fourth visit. Press it at the second visit.",
         '"2 and 4"'),
        ("StopCube", "Let it pass twice, then stop it on its second visit.", "which visit"),
        ("BinFill", "Put green cubes in the bin.", "how many"),
        ("BinFill", "Put 19 green cubes in the bin.", "no goal of the task fits"),
        ("BinFill", "Put -2 green cubes in the bin.", "minus"),
        ("VideoUnmask", "Lift the container over red and the one over blue, blue first.",
         "what comes first"),
        ("VideoUnmask", "Don't lift the container over red.", "not"),
        ("VideoRepick", "Pick up a cube twice.", "which"),
        ("VideoPlaceOrder", "Put the red cube on one of the targets.", '"on"'),
        ("PutInBox", "Put the tape in the red box.", "nothing red"),
    ],
)  # fmt: skip
def test_an_unclear_command_is_refused_with_the_reason(task, text, complaint):
    """It leaves several goals, or none; `complaint` is a part of the reasons that are given."""
    scene = get_episode(task, "test", 2).scene

    found = interpret(text, scene, task)

    assert len(found.goals) != 1
    assert complaint in " / ".join(found.not_understood)


def test_a_command_is_refused_if_the_first_of_its_two_steps_is_not_understood():
    """Without *Using what the video showed, first …* the last step alone would be another goal."""
    scene = get_episode("VideoUnmaskSwap", "random", 979917).scene
    text = (
        "Using what the video showed, first lift the container over the blue cube and put it back. "
        "After that, lift the container over the red cube."
    )

    found = interpret(text, scene, "VideoUnmaskSwap")

    assert found.goals == ()
    assert found.not_understood != ()

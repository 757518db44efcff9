"""The interpreter reads sentences that no template makes, and leaves open what they do not name."""

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from language_variants import first_episodes

from roboirg.core.conditions import Fact
from roboirg.core.episode import COLORS, Goal, Point, Scene, SceneObject
from roboirg.core.motions import Away, Swap
from roboirg.reader import interpret
from roboirg.tasks import get_task


def cube(name, x, y):
    return SceneObject(name, "cube", Point(x, y, 0.02), color=name.split("_")[1])


def container(number, x, y, color=None):
    name = f"container_{number}"
    box = SceneObject(name, "container", Point(x, y, 0.05))
    hidden = SceneObject(f"cube_{color}", "hidden_cube", Point(x, y, 0.02), 0.0, color, name)
    return (box, hidden) if color else (box,)


BUTTON = SceneObject("button", "button", Point(-0.2, 0.0, 0.0))
BIN = SceneObject("bin", "bin", Point(0.0, 0.15, 0.0))
SPREAD = (
    *(cube(f"cube_red_{number}", -0.1, -0.1 + 0.05 * number) for number in range(4)),
    *(cube(f"cube_blue_{number}", 0.0, -0.1 + 0.05 * number) for number in range(4)),
    *(cube(f"cube_green_{number}", 0.1, -0.1 + 0.05 * number) for number in range(4)),
)
FILL = Scene((BUTTON, BIN, *SPREAD, cube("cube_red_4", 0.19, -0.24)), (Away("cube_red_4", 0, 200),))
"""Rows of four cubes: red near, blue in the middle, green far; a red one comes later, far away."""
BOXES = (*container(0, 0, 0.1, "red"), *container(1, 0, 0, "green"), *container(2, 0, -0.1, "blue"))
SWAPPED = Scene(BOXES, (Swap("container_0", "container_2", 64, 50, 0.07),))
DISCS = tuple(SceneObject(f"target_{n}", "target", Point(0.1, n / 9, 0.0)) for n in range(4))
ORDERED = Scene(
    (BUTTON, cube("cube_red", 0, 0), cube("cube_blue", 0, 0.1), *DISCS),
    past=(
        Fact("placed", "cube_red", "target_3"),
        Fact("placed", "cube_red", "target_0"),
        Fact("pressed", "button"),
        Fact("placed", "cube_red", "target_1"),
        Fact("placed", "cube_red", "site"),
    ),
)
AROUND = Scene(ORDERED.objects, past=ORDERED.past[1:4])


def filled(**counts):
    named = [color for color in ("red", "blue", "green") if color in counts]
    return Goal.of(colors=tuple(named), counts=tuple(counts[color] for color in named))


@pytest.mark.parametrize(
    ("text", "counts"),
    [
        ("Throw one green cube and 2 red ones into the bin.", {"red": 2, "green": 1}),
        ("Take three reds, a blue one and a green one, and drop them into the bin.",
         {"red": 3, "blue": 1, "green": 1}),
        ("Grab two blue cubes and put them into the bin, then put the red cube in, too.",
         {"red": 1, "blue": 2}),
        ("I ordered a couple of the blue cubes. Put that many of them in the bin.", {"blue": 2}),
        (("I need 1 of the green cubes and 3 of the red cubes. Put that many of the latter and "
         "that many of the former into the bin."), {"red": 3, "green": 1}),
        ("My lucky number is 3. The blue cubes are nice. Drop that many of them into the bin.",
         {"blue": 3}),
        (("I once had two red cubes and five green cubes. Put two more red cubes than that and "
         "four fewer green cubes than that into the bin."), {"red": 4, "green": 1}),
        ("I own three green cubes. Put one cube fewer than that of the red cubes into the bin.",
         {"red": 2}),
        ("Put half as many green cubes as 8 into the bin.", {"green": 4}),
        (("My house is red and blue. Put two cubes that aren't in either of those colors, so "
         "other than that pair, into the bin."), {"green": 2}),
        (("My house is red and blue. I prefer blue. Put three cubes in the colour of those two "
         "that I don't prefer into the bin, and one of a color different from both."),
         {"red": 3, "green": 1}),
        ("Put four cubes in the other colour of red and green, not green, into the bin.",
         {"red": 4}),
        ("Drop two cubes of the same colour as the one farthest from you into the bin.",
         {"green": 2}),
        (("See the cube closest to the far right corner of the table. Put two cubes in the same "
         "color as the one there into the bin."), {"green": 2}),
        (("See the cube closest to you and the cube farthest from you? Put two cubes coloured like "
         "the one at the second place and one coloured like the one at the first into the bin."),
         {"green": 2, "red": 1}),
        ("Put a cube of the same colour as the one closest to the bin into it.", {"blue": 1}),
    ],
)  # fmt: skip
def test_amounts_in_other_words(text, counts):
    scene = FILL
    if "to you" in text or "from you" in text:
        scene = Scene((*FILL.objects, cube("cube_red_5", -0.17, 0), cube("cube_green_5", 0.17, 0)),
                      FILL.motions)  # fmt: skip
    assert interpret(text, scene, "BinFill").goals == (filled(**counts),)


@pytest.mark.parametrize(
    ("text", "counts"),
    [
        ("She wants two of the red and one of the blue cubes. Put exactly those into the bin.",
         {"red": 2, "blue": 1}),
        ("I need one green cube and three red cubes. Throw just these into the bin.",
         {"red": 3, "green": 1}),
        (("Dad asked for one of the red, one of the blue and two of the green cubes. Put precisely "
          "those into the bin."), {"red": 1, "blue": 1, "green": 2}),
        ("I own four red and two blue cubes. Drop half as many of each into the bin.",
         {"red": 2, "blue": 1}),
        ("I own one red and two blue cubes. Drop two more of each into the bin.",
         {"red": 3, "blue": 4}),
        ("Mom has three red, two blue and three green cubes. Put one fewer of each into the bin.",
         {"red": 2, "blue": 1, "green": 2}),
        ("Put half as many of each as four red and six green cubes into the bin.",
         {"red": 2, "green": 3}),
        ("Drop 2 fewer of each than 3 red, 3 blue and 4 green cubes into the bin.",
         {"red": 1, "blue": 1, "green": 2}),
        ("Put twice as many of each as one red and two blue cubes into the bin.",
         {"red": 2, "blue": 4}),
    ],
)  # fmt: skip
def test_amounts_of_several_colors_at_once(text, counts):
    expected = {filled(**counts)} if sum(counts.values()) <= 5 else set()
    assert left_over(text) == expected


@pytest.mark.parametrize(
    ("words", "possible"),
    [
        ("exactly those", lambda counts: sum(counts) > 1),
        ("half as many of each", lambda counts: len(counts) > 1),
        ("twice as many of each", lambda counts: len(counts) > 1 and {*counts} <= {2, 4}),
        ("one more of each", lambda counts: len(counts) > 1 and 1 not in counts),
    ],
)
def test_amounts_of_several_colors_need_their_introduction(words, possible):
    found = interpret(f"Put {words} into the bin.", FILL, "BinFill")
    every = get_task("BinFill").goals(FILL)
    assert found.goals == tuple(one for one in every if possible(one.numbers("counts")))
    assert len(found.goals) > 1
    assert found.not_understood == ("nothing before the command introduces amounts",)


@pytest.mark.parametrize(
    ("introduction", "words", "other"),
    [
        ("I need two of the red and one of the blue cubes.", "exactly those", "one red"),
        ("I own four red and two blue cubes.", "half as many of each", "twice as many of each"),
        ("I own four red and two blue cubes.", "half as many of each", "exactly those"),
        ("I own three red and two blue cubes.", "one fewer of each", "two fewer of each"),
    ],
)
def test_each_word_for_several_amounts_counts(introduction, words, other):
    put = f"{introduction} Put {{}} into the bin."
    (goal,) = left_over(put.format(words))
    assert goal not in left_over(put.format(other))


NEITHER = ("that is neither", "which is neither", "whose color is neither", "colored neither")


@pytest.mark.parametrize("words", NEITHER)
@pytest.mark.parametrize("pair", ["of those", "of them", "of these", "of the two"])
def test_neither_excludes_an_introduced_pair(words, pair):
    pick = Scene(
        (BUTTON, *(cube(f"cube_{one}", 0, at / 9) for at, one in enumerate(COLORS)), *DISCS)
    )
    take = f"Take the cube {words} {pair} and place it on the target once."

    def colors(text):
        return {goal.text("color") for goal in left_over(text, pick, "PickXtimes")}

    assert colors(f"My hat is red and blue. {take}") == {"green"}
    assert colors(f"My hat is red and green. {take}") == {"blue"}
    assert colors(take) == set(COLORS)  # the pair has to be introduced
    counted = f"Put two cubes {words.replace('is', 'are')} {pair} into the bin."
    assert left_over(f"My hat is red and blue. {counted}") == {filled(green=2)}
    assert left_over(counted) == {filled(**{one: 2}) for one in COLORS}


@pytest.mark.parametrize("words", NEITHER)
def test_neither_excludes_a_pair_that_it_names(words):
    for one, two in itertools.permutations(COLORS, 2):
        (rest,) = set(COLORS) - {one, two}
        text = f"Lift the container over the cube {words} {one} nor {two}."
        assert left_over(text, SWAPPED, "VideoUnmaskSwap") == {Goal.of(colors=(rest,))}


def left_over(text, scene=FILL, task="BinFill"):
    return set(interpret(text, scene, task).goals)


def test_amounts_that_are_left_open():
    assert left_over("Put that many of them into the bin.") == {
        filled(**{color: number})
        for color, most in (("red", 5), ("blue", 4), ("green", 4))
        for number in range(1, most + 1)
    }
    pairs = left_over("Put two cubes of a color other than that pair and one cube in the color of "
                      "that pair that I did not choose into the bin.")  # fmt: skip
    assert pairs == {filled(**{one: 2, two: 1}) for one, two in itertools.permutations(COLORS, 2)}
    assert left_over("Put twice as many red cubes as that into the bin.") == {
        filled(red=2), filled(red=4)
    }  # fmt: skip


PICK_ONE = Scene((BUTTON, cube("cube_red", 0, 0), DISCS[0]))
STOP = next(first_episodes("StopCube", "train", 1)).scene


@pytest.mark.parametrize(
    ("text", "scene", "task"),
    [
        ("Put five blue cubes into the bin.", FILL, "BinFill"),
        ("Put two red cubes and four red cubes into the bin.", FILL, "BinFill"),
        ("Take the blue cube, put it on the target once.", PICK_ONE, "PickXtimes"),
        ("Take the red cube, then take the blue cube and put it on the target of its third stay.",
         ORDERED, "VideoPlaceOrder"),
        ("Stop the cube during its first visit.", STOP, "StopCube"),
        ("Take the red cube and put it on the target of its fourth placement.", ORDERED,
         "VideoPlaceOrder"),
        ("Stop the cube at the visit right before visit 6.", STOP, "StopCube"),
        ("Lift the container that hides the red cube, put it down and lift the one over the red.",
         SWAPPED, "VideoUnmaskSwap"),
    ],
)  # fmt: skip
def test_contradictions_fit_nothing(text, scene, task):
    assert not left_over(text, scene, task)


@pytest.mark.parametrize(
    ("text", "visit"),
    [
        ("Stop it on the target during the 4th visit.", 4),
        ("When the cube is on the target for the third time, press the button.", 3),
        ("Halt the cube on visit number five.", 5),
        ("Press the button at its last visit.", 5),
        ("Press the button at its second to last visit.", 4),
        ("I dream of the second visit. Stop the cube during the very next one.", 3),
        ("I dream of the fifth visit. Stop the cube in the previous visit.", 4),
        ("I dream of the fifth visit. Stop the cube three visits earlier than that.", 2),
        ("I dream of visit 2. Press the button during the visit immediately following it.", 3),
        ("Stop the cube during the visit two before the fourth.", 2),
        ("Stop the cube during the visit right after visit 4.", 5),
        ("My number is 2. Stop the cube during the visit whose number is double that.", 4),
        ("My number is 7. Stop the cube on the visit whose number is that minus 4.", 3),
        ("My number is 1. Stop the cube on the visit whose number is thrice that.", 3),
        ("Stop the cube during the visit whose number is three less than eight.", 5),
        (("I like the third visit. My number is 3. Stop the cube during the visit whose number is "
         "one less than that."), 2),
        (("I like the fifth visit. My number is 3. Stop the cube during the visit whose number is "
         "one less than that."), 2),
        (("I like the third visit. My number is 2. Stop the cube during the visit right after "
         "that."), 4),
        (("I like the third visit. My aunt likes the fifth visit, but ignore that. Stop the cube "
         "during that visit."), 3),
    ],
)  # fmt: skip
def test_visits_in_other_words(text, visit):
    assert interpret(text, STOP, "StopCube").goals == (Goal.of(visit=visit),)


@pytest.mark.parametrize(
    ("text", "color", "placement"),
    [
        ("Put the red cube on the target of the third placement.", "red", 3),
        ("Take the blue cube and put it on the disc of placement number 2.", "blue", 2),
        ("Take the blue cube and put it on the target of the final placement.", "blue", 3),
        (("Its 1st placement was lovely. I love blue. Take it and place it on the target of the "
         "placement two after that."), "blue", 3),
        (("I liked the third placement. Take the red cube and put it on the target of the "
         "preceding one."), "red", 2),
        (("I liked the third placement. Take the red cube and put it on the target of the "
         "placement that's a neighbor of that."), "red", 2),
    ],
)  # fmt: skip
def test_placements_in_other_words(text, color, placement):
    goal = Goal.of(color=color, placement=placement)
    assert interpret(text, ORDERED, "VideoPlaceOrder").goals == (goal,)


@pytest.mark.parametrize(
    ("text", "relation"),
    [
        ("Take the red cube and place it where it was just before the button was pressed.",
         "before"),
        ("Put the red cube on the target that it was on following the press.", "after"),
        (("Take the red cube, and after that put it on the target where it was placed before the "
         "press."), "before"),
        (("Take the red cube and put it where it was when it was not before but after the button "
         "press."), "after"),
        (("I loved what it did after pressing the button. Take the red cube, put it where it was "
         "placed at that time."), "after"),
        (("There's a moment before the press and one after the press. I'd go for the one before "
         "the press. Take the red cube, put it where it was at the other moment."), "after"),
        ("Take the red cube, put it where it was at the other moment than after the press.",
         "before"),
        (("There's a moment before the press and one after the press. I'd go for the one after "
         "the press. Take the red cube, put it where it was at the other moment."), "before"),
        (("I loved the placement after the press. Take the red cube and put it on the target of "
         "the placement next to that."), "before"),
        (("I liked the part before the press. My aunt liked the part after the press, but never "
         "mind. Take the red cube and put it where it was placed then."), "before"),
    ],
)  # fmt: skip
def test_moments_in_other_words(text, relation):
    goal = Goal.of(color="red", relation=relation)
    assert interpret(text, AROUND, "VideoPlaceButton").goals == (goal,)


OPEN = {
    "visits": (STOP, "StopCube", "visit"),
    "moments": (AROUND, "VideoPlaceButton", "relation"),
    "repicks": (next(first_episodes("VideoRepick", "train", 1)).scene, "VideoRepick", "repeats"),
    "swaps": (SWAPPED, "VideoUnmaskSwap", "colors"),
}


@pytest.mark.parametrize(
    ("kind", "text", "values"),
    [
        ("visits", "Stop the cube during that visit.", {2, 3, 4, 5}),
        ("visits", "Stop the cube during the visit right after that.", {2, 3, 4, 5}),
        ("visits", "Stop the cube during the visit two before that.", {2, 3}),
        ("visits", "Stop the cube on the visit whose number is half of that.", {2, 3, 4, 5}),
        ("visits", "Stop the cube on the visit that is a direct neighbour of the third.", {2, 4}),
        (
            "visits",
            ("I like the second visit. I like the fourth visit. Stop the cube during that visit."),
            {2, 4},
        ),
        (
            "moments",
            "Take the red cube and put it on the target where it was placed.",
            {"after", "before"},
        ),
        (
            "moments",
            "Take the red cube and put it on the target where it was placed then.",
            {"after", "before"},
        ),
        (
            "moments",
            (
                "Take the red cube and put it on the target where it was placed at the other of "
                "the two moments, not that one."
            ),
            {"after", "before"},
        ),
        (
            "moments",
            (
                "Before and after the press it went well. Take the red cube and put it on the "
                "target where it was placed then."
            ),
            {"after", "before"},
        ),
        ("repicks", "Lift the cube of the video and lower it thrice, once you are ready.", {3}),
        ("repicks", "Lift it up and put it down, and do so 2 times.", {2}),
        ("repicks", "Lift it and lower it, once you are ready, two times.", {2}),
        ("repicks", "I say four. Lift the same cube and put it down half as often as that.", {2}),
        ("repicks", "Lift it and put it down one time fewer than that.", {1, 2, 3}),
        (
            "repicks",
            (
                "Two and three are my numbers. I prefer two. The sun is out. Lift it and put it "
                "down the other number of times."
            ),
            {3},
        ),
        (
            "repicks",
            (
                "I say this twice, but three is fine. I want the latter. Lift it and put it down "
                "that number of times."
            ),
            {3},
        ),
        ("swaps", "Lift the container that was at the far left before they moved.", {("red",)}),
        ("swaps", "Lift the container that was originally at the far left.", {("red",)}),
        ("swaps", "Lift the container that is now at the far left.", {("blue",)}),
        ("swaps", "Lift the container at the far left.", {("blue",), ("red",)}),
        ("swaps", "Lift the container second from the left.", {("green",)}),
        (
            "swaps",
            (
                "See the container at the far left? That was before anything moved. Lift the "
                "container there."
            ),
            {("red",)},
        ),
        (
            "swaps",
            (
                "See the container at the far left? That was after everything had moved. Lift the"
                " container there."
            ),
            {("blue",)},
        ),
        (
            "swaps",
            (
                "Press both buttons first, then lift the container that was at the far right "
                "before the swaps started, put it back, and lift the container that was second "
                "from the left then."
            ),
            {("blue", "green")},
        ),
        (
            "repicks",
            (
                "Two and three are my numbers. I prefer two and three. Lift it and put it down "
                "the other number of times."
            ),
            {2, 3},
        ),
        (
            "swaps",
            "I like red, green and blue. Lift the container that hides the latter.",
            {("blue",)},
        ),
        (
            "swaps",  # what is chosen last counts
            (
                "I like red. I like blue. I want the former. I chose the latter. Lift the "
                "container that hides the cube I chose."
            ),
            {("blue",)},
        ),
        (
            "swaps",
            "I like red. I like blue. Lift the container first that hides the latter.",
            {("blue",)},
        ),
        (
            "swaps",
            (
                "I like red. I like blue. Lift for the first time the container that hides the "
                "latter."
            ),
            {("blue",)},
        ),
        (
            "swaps",
            "I like red. I like blue. First lift the container that hides the latter.",
            {("blue",)},
        ),
        (
            "swaps",
            (
                "I like red. I like blue. Lift the container that hides the second, but press the"
                " button first."
            ),
            {("blue",)},
        ),
        (
            "swaps",
            (
                "I like red. I like blue. First lift the one over the latter, put it down, but "
                "then lift the one over the former."
            ),
            {("blue", "red")},
        ),
    ],
)
def test_what_the_words_leave_open_stays_open_and_no_more(kind, text, values):
    scene, task, slot = OPEN[kind]
    assert {goal[slot] for goal in left_over(text, scene, task)} == values


def test_a_number_from_another_number_is_read_with_two_targets():
    *_, episode = first_episodes("SwingXtimes", "train", 4)
    swing = "Swing the blue cube to the right and left targets two times fewer than five."
    goal = Goal.of(color="blue", repeats=3)
    assert interpret(swing, episode.scene, "SwingXtimes").goals == (goal,)


def test_late_cubes_are_nowhere_yet():
    place = "Put two cubes of the same colour as the one closest to the far right corner into the"
    assert left_over(f"{place} bin.") == {filled(green=2)}
    there_at_once = Scene(FILL.objects)
    assert left_over(f"{place} bin.", there_at_once) == {filled(red=2)}


COUNTS = st.dictionaries(st.sampled_from(COLORS), st.integers(1, 4), min_size=1)
WORDED = ("zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
NUMBERS = st.tuples(st.integers(1, 10), st.booleans())
"""A number, and whether it is spelled as a word."""


def spelled(number, worded):
    return WORDED[number] if worded else str(number)


@settings(max_examples=30)
@given(COUNTS, st.randoms(), st.booleans())
def test_any_amounts_in_any_order_are_read(counts, random, worded):
    items = [
        f"{spelled(number, worded)} {color} cube{'' if number == 1 else 's'}"
        for color, number in counts.items()
    ]
    random.shuffle(items)
    text = f"Put {' and '.join(items)} into the bin."
    expected = {filled(**counts)} if sum(counts.values()) <= 5 else set()
    assert left_over(text) == expected


@settings(max_examples=30)
@given(COUNTS, st.sampled_from(["former", "first"]))
def test_any_introduced_amounts_are_pointed_at(counts, words):
    pointers = {"former": ("former", "latter"), "first": ("first", "second", "third")}[words]
    if len(counts) > len(pointers) or (words == "former" and len(counts) == 1):
        return
    asked = " and ".join(f"{number} of the {color} cubes" for color, number in counts.items())
    items = [f"that many of the {pointer}" for pointer in pointers[: len(counts)]]
    text = f"I need {asked}. Drop {', '.join(items)} into the bin."
    expected = {filled(**counts)} if sum(counts.values()) <= 5 else set()
    assert left_over(text) == expected


@settings(max_examples=30)
@given(COUNTS, st.sampled_from(["one fewer", "two more", "half as many", "twice as many"]))
def test_any_amounts_of_each_are_computed(counts, words):
    result = {
        "one fewer": lambda count: count - 1, "two more": lambda count: count + 2,
        "half as many": lambda count: count / 2, "twice as many": lambda count: count * 2,
    }[words]  # fmt: skip
    own = ", ".join(f"{WORDED[count]} {color}" for color, count in counts.items())
    text = f"I own {' and '.join(own.rsplit(', ', 1))} cubes. Put {words} of each into the bin."
    wanted = {color: result(count) for color, count in counts.items()}
    possible = sum(wanted.values()) <= 5 and all(one in range(1, 5) for one in wanted.values())
    assert left_over(text) == ({filled(**wanted)} if possible else set())


@settings(max_examples=30)
@given(NUMBERS, NUMBERS, st.sampled_from(["more", "less", "fewer"]), st.booleans())
def test_any_sum_is_computed(quantity, step, way, introduced):
    result = quantity[0] + step[0] * (1 if way == "more" else -1)
    base = "that" if introduced else spelled(*quantity)
    text = f"Stop the cube during the visit whose number is {spelled(*step)} {way} than {base}."
    if introduced:
        text = f"My number is {spelled(*quantity)}. {text}"
    expected = {Goal.of(visit=result)} if 2 <= result <= 5 else set()
    assert left_over(text, STOP, "StopCube") == expected


@settings(max_examples=30)
@given(
    st.integers(1, 5),
    st.integers(1, 4),
    st.sampled_from(["after", "before"]),
    st.sampled_from(["{step} {way} that", "{step} visits {way} that", "{step} {way} the {base}"]),
)
def test_any_step_in_a_series_is_taken(base, step, way, words):
    result = base + step * (1 if way == "after" else -1)
    ordinal = ("first", "second", "third", "fourth", "fifth")[base - 1]
    which = words.format(step=spelled(step, worded=True), way=way, base=ordinal)
    text = f"I love the {ordinal} visit. Stop the cube during the visit {which}."
    expected = {Goal.of(visit=result)} if 2 <= result <= 5 else set()
    assert left_over(text, STOP, "StopCube") == expected

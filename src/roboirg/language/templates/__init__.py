"""The wordings that all tasks share. Every change needs a new `LANGUAGE_VERSION`.

`phrases` explains fields and alternatives. American spelling, as in the data that
policies are trained on. Neutral distractors and cues must name no color, number, ordinal, side
or place; a test reads them.
"""

from __future__ import annotations

from typing import NamedTuple

LANGUAGE_VERSION = "1.1.0"

COLOR_INTRODUCTIONS = (
    "I have always had a soft spot for {things}.",
    "{things} [is|are] the nicest [thing|things] on this table.",
    "My daughter keeps talking about {things}.",
    "I was just thinking about {things}.",
)
NUMBER_INTRODUCTIONS = (
    "My lucky number is {number}.",
    "{number} is the number of the day.",
    "If you asked me for a number, I would say {number}.",
    "The number on my jersey is {number}.",
)
PAIR_INTRODUCTIONS = (
    "{pair} are the colors of my soccer team.",
    "My kitchen is painted {pair}.",
    "I think that {pair} go well together.",
    "The flag of my home town is {pair}.",
)
AMOUNT_INTRODUCTIONS = (
    "My daughter asked for {things}.",
    "I was just thinking about {things}.",
    "The plan of the day calls for {things}.",
    "I have promised my friend {things}.",
)
REFERENCE_AMOUNT_INTRODUCTIONS = (
    "Yesterday I played with {things}.",
    "My nephew owns {things}.",
    "The box at home holds {things}.",
)
"""Amounts that only lead to the goal; they may exceed the cubes on the table."""
VISIT_INTRODUCTIONS = (
    "I was just thinking about {which}.",
    "Everybody here is waiting for {which}.",
    "I have placed my bet on {which}.",
)
PLACEMENT_INTRODUCTIONS = (
    "In the video I liked {which}.",
    "{which} in the video was very neat.",
    "I could talk for hours about {which} in the video.",
)
MOMENT_INTRODUCTIONS = (
    "What happened {moment} is still on my mind.",
    "I remember best what the video showed {moment}.",
    "The part {moment} was the highlight of the video.",
)
TWO_MOMENTS_INTRODUCTIONS = (
    "Two moments stand out in the video, {pair}, and my sister prefers {single}.",
    "Of the two moments {pair}, my brother would choose {single}.",
    "If my mother had to choose between the two moments {pair}, it would be {single}.",
)
NEIGHBOR_INTRODUCTIONS = (
    "In the video I liked the placement {moment}.",
    "The placement {moment} was very neat.",
    "I could talk for hours about the placement {moment}.",
)
SINGLED_INTRODUCTIONS = (
    "Of the two, I would choose {single}.",
    "If I had to choose between the two, it would be {single}.",
    "Asked to choose, I would go for {single}.",
)
PLACE_INTRODUCTIONS = (
    "Have a look at {things}.",
    "My eyes keep going back to {things}.",
    "Something about {things} caught my eye.",
)
SIDED_PLACE_INTRODUCTIONS = (
    "Have a look at {things}, as seen from where you stand.",
    "From where you stand, {things} [is|are] hard to miss.",
    "I am looking at {things}, going by your left and right.",
)
CAMERA_PLACE_INTRODUCTIONS = (
    "Have a look at {things}, as seen in the picture of the front camera.",
    "In the picture of the front camera, {things} [is|are] hard to miss.",
    "I am looking at {things}, going by left and right in the front camera.",
)
"""The same with left and right of the camera, which faces the robot."""
MOVED_INTRODUCTIONS = (
    "I mean how things stood before anything moved.",
    "I am talking about the places before anything moved.",
    "That is where things stood before anything moved.",
)
"""Added to place introductions where objects change places."""

COLOR_REINFORCEMENTS = (
    "{ref} [was a present|were presents] from my aunt.",
    "I would recognize {ref} anywhere.",
    "I could not do without {ref}.",
    "I took a photo of {ref} yesterday.",
)
NUMBER_REINFORCEMENTS = (
    "I have liked {ref} ever since I was a child.",
    "{ref} has always brought me luck.",
    "{ref} seems to follow me everywhere.",
)
VISIT_REINFORCEMENTS = (
    "I would not want to miss {ref}.",
    "I have been looking forward to {ref} all day.",
    "My friends keep asking me about {ref}.",
)
VIDEO_REINFORCEMENTS = (
    "I could watch {ref} again and again.",
    "I have told everybody about {ref}.",
    "I would recognize {ref} anywhere.",
)
"""For placements and moments."""


class NeutralRemark(NamedTuple):
    """A remark that has nothing to do with the task.

    Attributes:
        text: the sentence.
        thing: the one thing or animal in it that *it* could mean in the next sentence; None if
            there is none, as for people, plurals and the weather.
    """

    text: str
    thing: str | None = None


NEUTRAL_DISTRACTORS = (
    NeutralRemark("The coffee machine is making a strange noise.", "the coffee machine"),
    NeutralRemark("I slept really well last night."),
    NeutralRemark("It has been raining since this morning."),
    NeutralRemark("My phone needs charging again.", "my phone"),
    NeutralRemark("Somebody should water the plants."),
    NeutralRemark("The neighbors are playing music."),
    NeutralRemark("Lunch was delicious today."),
    NeutralRemark("I still have to call my dentist."),
    NeutralRemark("The bus was late again this morning.", "the bus"),
    NeutralRemark("A bird is singing outside the window.", "a bird"),
    NeutralRemark("My shoes are still wet from the walk."),
    NeutralRemark("The radio says the weekend will be sunny.", "the radio"),
    NeutralRemark("I forgot my umbrella on the train.", "my umbrella"),
    NeutralRemark("The printer is out of paper.", "the printer"),
    NeutralRemark("Grandma sends her love."),
    NeutralRemark("The dog is barking at the mailman.", "the dog"),
    NeutralRemark("I should really clean these windows."),
    NeutralRemark("The elevator is being repaired.", "the elevator"),
    NeutralRemark("Traffic was terrible on the way to work."),
    NeutralRemark("I have a meeting later today.", "a meeting"),
    NeutralRemark("My cousin is learning to play the violin.", "the violin"),
    NeutralRemark("The soup needs a pinch of salt.", "the soup"),
    NeutralRemark("We ran out of milk at breakfast."),
    NeutralRemark("The movie last night was much too long.", "the movie"),
)
COMPETING_COLOR_DISTRACTORS = (
    "My neighbor prefers {other}, but that does not matter here.",
    "My friend painted his door {other}, but never mind that.",
    "There is a {other} car outside, which has nothing to do with your task.",
)
COMPETING_NUMBER_DISTRACTORS = (
    "My neighbor has {other} [cat|cats], but that does not matter here.",
    "The bus was {other} [minute|minutes] late, but never mind that.",
    "I have {other} [meeting|meetings] today, which has nothing to do with your task.",
)
COMPETING_VISIT_DISTRACTORS = (
    "My neighbor is waiting for the {other} visit, but that does not matter here.",
    "My friend has bet on the {other} visit, but never mind that.",
    "Yesterday I missed the {other} visit, which has nothing to do with your task.",
)
COMPETING_PLACEMENT_DISTRACTORS = (
    "My neighbor liked the {other} placement, but that does not matter here.",
    "My friend laughed about the {other} placement, but never mind that.",
    "My sister missed the {other} placement, which has nothing to do with your task.",
)
COMPETING_MOMENT_DISTRACTORS = (
    "My neighbor liked the part {other}, but that does not matter here.",
    "My friend laughed about the part {other}, but never mind that.",
    "My sister missed the part {other}, which has nothing to do with your task.",
)

CUES = (
    "Here is what I would like you to do.",
    "Now, please do the following.",
    "All right, this is your task.",
    "Okay, let us get to work.",
    "Please listen, because this is what I need from you.",
)

EXCLUSIONS = (
    "the {thing} of a color other than {pair}",
    "the {thing} whose color is different from {pair}",
)
PAIR_ANAPHORS = ("that pair", "those two")
COMPLEMENTS = ("the {thing} in {other}", "the {thing} with {other}")
"""For the second pick: of the two excluded colors, the one that was not chosen."""
AMOUNT_PAIR_ANAPHORS = ("that pair",)
"""Next to numbers of cubes, *those two* would mean two cubes."""
AMOUNT_EXCLUSIONS = (
    "{thing}[|s] of a color other than {pair}",
    "{thing}[|s] whose color is different from {pair}",
)
AMOUNT_COMPLEMENTS = ("{thing}[|s] in {other}", "{thing}[|s] with {other}")

MOMENTS = {"before": "right before the button press", "after": "right after the button press"}
MOMENT_ANAPHORS = ("at that moment", "then")
MOMENT_COMPLEMENTS = (
    "the other of the two moments, not {single}",
    "whichever of the two moments is not {single}",
)
NEIGHBOR = "the placement that is a direct neighbor of {single}"
"""Of two placements, each is the other's neighbor; *earlier* would give it away."""


class Relation(NamedTuple):
    """The relation of a number to a reference quantity.

    Attributes:
        name: for records.
        times: words for a number of repetitions.
        cubes: words for a number of cubes of a color.
        value: words for a number.
        offset: the result is ``factor * reference + offset``.
        factor: see `offset`.
        spells: the number that the words contain; they would give away a result of this value.
    """

    name: str
    times: str
    cubes: str
    value: str
    offset: int = 0
    factor: float = 1.0
    spells: int | None = None

    def reference(self, result: int) -> int | None:
        """Return the quantity to introduce; None if it is no whole number."""
        reference = (result - self.offset) / self.factor
        return int(reference) if reference.is_integer() else None


MAX_REFERENCE = 10
"""The largest quantity to introduce."""

RELATIONS = (
    Relation(
        "one fewer",
        "one time fewer than {number}",
        "one fewer {color} cube than {number}",
        "one less than {number}",
        offset=-1,
        spells=1,
    ),
    Relation(
        "one more",
        "one more time than {number}",
        "one more {color} cube than {number}",
        "one more than {number}",
        offset=1,
        spells=1,
    ),
    Relation(
        "two fewer",
        "two fewer times than {number}",
        "two fewer {color} cubes than {number}",
        "two less than {number}",
        offset=-2,
        spells=2,
    ),
    Relation(
        "two more",
        "two more times than {number}",
        "two more {color} cubes than {number}",
        "two more than {number}",
        offset=2,
        spells=2,
    ),
    Relation(
        "twice",
        "twice as many times as {number}",
        "twice as many {color} cubes as {number}",
        "twice {number}",
        factor=2.0,
        spells=2,
    ),
    Relation(
        "half",
        "half as many times as {number}",
        "half as many {color} cubes as {number}",
        "half of {number}",
        factor=0.5,
    ),
)


class Step(NamedTuple):
    """The relation of an element of a series to a reference element.

    Attributes:
        name: for records.
        words: words after the noun.
        offset: from the reference to the result.
        spells: as in `Relation`.
    """

    name: str
    words: str
    offset: int
    spells: int | None = None


STEPS = (
    Step("right after", "right after {reference}", 1),
    Step("right before", "right before {reference}", -1),
    Step("two after", "two after {reference}", 2, spells=2),
    Step("two before", "two before {reference}", -2, spells=2),
)
NEIGHBORS = {
    1: Step("neighbor", "that is a direct neighbor of {reference}", -1),
    2: Step("neighbor", "that is a direct neighbor of {reference}", 1),
}
"""The steps in a series of two elements, by position."""

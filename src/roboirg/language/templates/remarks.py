"""Remarks between introduction and command: reinforcements, distractors and cues.

Neutral distractors and cues must name no color, number, ordinal, side or place; a test reads them.
"""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.word_pools import Pools

COLOR_REINFORCEMENTS = Pools(
    train=(
        "{ref} [was a present|were presents].",
        "I know {ref} well.",
        "I painted {ref}.",
        "I would miss {ref}.",
    ),
    test=(
        "I made {ref}.",
        "I am happy with {ref}.",
        "I cleaned {ref}.",
        "I found {ref}.",
    ),
)
NUMBER_REINFORCEMENTS = Pools(
    train=("{ref} brings me luck.", "I remember {ref}.", "I keep seeing {ref}."),
    test=("I like {ref}.", "{ref} feels lucky.", "{ref} feels right."),
)
VISIT_REINFORCEMENTS = Pools(
    train=("I must see {ref}.", "{ref} will be fun.", "I am ready for {ref}."),
    test=("{ref} will be great.", "I cannot miss {ref}.", "I am excited about {ref}."),
)
VIDEO_REINFORCEMENTS = Pools(
    train=("I often think of {ref}.", "{ref} made me laugh.", "I talk a lot about {ref}."),
    test=("{ref} surprised me.", "I loved {ref}.", "I could watch {ref} forever."),
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


NEUTRAL_DISTRACTORS = Pools(
    train=(
        NeutralRemark("The coffee machine is noisy.", "the coffee machine"),
        NeutralRemark("I slept really well."),
        NeutralRemark("It is raining again."),
        NeutralRemark("My phone needs charging.", "my phone"),
        NeutralRemark("The plants need water."),
        NeutralRemark("The neighbors are playing music."),
        NeutralRemark("Lunch was delicious."),
        NeutralRemark("I must call my dentist."),
        NeutralRemark("The bus was late again.", "the bus"),
        NeutralRemark("A bird is singing outside.", "a bird"),
        NeutralRemark("My shoes are still wet."),
        NeutralRemark("The radio is too loud.", "the radio"),
        NeutralRemark("I forgot my umbrella.", "my umbrella"),
        NeutralRemark("The printer is out of paper.", "the printer"),
        NeutralRemark("Grandma sends her love."),
        NeutralRemark("The dog is barking.", "the dog"),
        NeutralRemark("I should clean these windows."),
        NeutralRemark("The elevator is broken.", "the elevator"),
        NeutralRemark("Traffic was terrible."),
        NeutralRemark("I have a meeting.", "a meeting"),
        NeutralRemark("My cousin bought a violin.", "a violin"),
        NeutralRemark("The soup needs salt.", "the soup"),
        NeutralRemark("We ran out of milk."),
        NeutralRemark("The movie was too long.", "the movie"),
    ),
    test=(
        NeutralRemark("The kettle is boiling.", "the kettle"),
        NeutralRemark("I am a little tired."),
        NeutralRemark("It may snow tonight."),
        NeutralRemark("My bike is rusty.", "my bike"),
        NeutralRemark("The dishes are still dirty."),
        NeutralRemark("The kids are at school."),
        NeutralRemark("Breakfast was too short."),
        NeutralRemark("I owe Mom a letter."),
        NeutralRemark("The train was crowded.", "the train"),
        NeutralRemark("A cat is asleep outside.", "a cat"),
        NeutralRemark("My hands are cold."),
        NeutralRemark("The clock is slow.", "the clock"),
        NeutralRemark("I lost my wallet.", "my wallet"),
        NeutralRemark("The fridge is humming.", "the fridge"),
        NeutralRemark("Uncle Tom says hello."),
        NeutralRemark("The baby is laughing."),
        NeutralRemark("I should water the flowers."),
        NeutralRemark("The heating is off.", "the heating"),
        NeutralRemark("Parking was hard."),
        NeutralRemark("I bought a new coat.", "a new coat"),
        NeutralRemark("My aunt plays the piano.", "the piano"),
        NeutralRemark("The bread smells good.", "the bread"),
        NeutralRemark("We are out of sugar."),
        NeutralRemark("The concert was lovely.", "the concert"),
    ),
)
COMPETING_COLOR_DISTRACTORS = Pools(
    train=(
        "My neighbor prefers {other}, but never mind.",
        "His door is {other}, not that it matters.",
        "There is a {other} car outside, but ignore that.",
    ),
    test=(
        "My boss wears {other}, but never mind.",
        "Her coat is {other}, which is irrelevant.",
        "I saw a {other} bird, but forget it.",
    ),
)
COMPETING_NUMBER_DISTRACTORS = Pools(
    train=(
        "My neighbor has {other} [cat|cats], but never mind.",
        "The bus was {other} [minute|minutes] late, not that it matters.",
        "I have {other} [meeting|meetings] today, but ignore that.",
    ),
    test=(
        "My boss has {other} [car|cars], but never mind.",
        "I waited {other} [hour|hours], which is irrelevant.",
        "She ate {other} [apple|apples], but forget it.",
    ),
)
COMPETING_VISIT_DISTRACTORS = Pools(
    train=(
        "My neighbor awaits the {other} visit, but never mind.",
        "He bet on the {other} visit, not that it matters.",
        "She missed the {other} visit, but ignore that.",
    ),
    test=(
        "My boss prefers the {other} visit, but never mind.",
        "They like the {other} visit, which is irrelevant.",
        "Yesterday I saw the {other} visit, but forget it.",
    ),
)
COMPETING_PLACEMENT_DISTRACTORS = Pools(
    train=(
        "My neighbor liked the {other} placement, but never mind.",
        "He missed the {other} placement, not that it matters.",
        "She described the {other} placement, but ignore that.",
    ),
    test=(
        "My boss liked the {other} placement, but never mind.",
        "They praised the {other} placement, which is irrelevant.",
        "My sister drew the {other} placement, but forget it.",
    ),
)
COMPETING_MOMENT_DISTRACTORS = Pools(
    train=(
        "My neighbor liked the part {other}, but never mind.",
        "He missed the part {other}, not that it matters.",
        "She described the part {other}, but ignore that.",
    ),
    test=(
        "My boss liked the part {other}, but never mind.",
        "They praised the part {other}, which is irrelevant.",
        "My sister drew the part {other}, but forget it.",
    ),
)

CUES = Pools(
    train=(
        "Anyway, listen.",
        "Now do this.",
        "Okay, listen.",
        "So, listen.",
        "Please listen.",
    ),
    test=(
        "Anyway, here goes.",
        "Here is my request.",
        "Please do this.",
        "Here goes.",
        "Your turn.",
    ),
)

"""Remarks between introduction and command: reinforcements, distractors and cues.

Neutral distractors and cues must name no color, number, ordinal, side or place; a test reads them.
"""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.word_pools import Pools

COLOR_REINFORCEMENTS = Pools(
    train=(
        "I built {ref} myself.",
        "I got {ref} last year.",
        "I painted {ref} myself.",
        "My kids painted {ref}.",
    ),
    test=(
        "I made {ref} myself.",
        "I bought {ref} last week.",
        "I cleaned {ref} this morning.",
        "I found {ref} outside.",
    ),
)
NUMBER_REINFORCEMENTS = Pools(
    train=("{ref} worked well.", "{ref} was enough.", "{ref} is easy to remember."),
    test=("{ref} was perfect.", "I was happy with {ref}.", "{ref} seemed fine."),
)
VISIT_REINFORCEMENTS = Pools(
    train=("I want a photo of {ref}.", "I do not want to miss {ref}.", "Dad bet on {ref}."),
    test=("My son bet on {ref}.", "I must not miss {ref}.", "I would like to film {ref}."),
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
        NeutralRemark("Sorry, my phone rang.", "my phone"),
        NeutralRemark("Sorry, I got distracted."),
        NeutralRemark("Oh, it is raining."),
        NeutralRemark("Sorry, my pen fell.", "my pen"),
        NeutralRemark("Sorry, I coughed."),
        NeutralRemark("Oh, Dad called."),
        NeutralRemark("Oh, my hands are cold."),
        NeutralRemark("Oh, Ben called."),
        NeutralRemark("Oh, my coffee is cold.", "my coffee"),
        NeutralRemark("Oh, a bird is singing.", "a bird"),
        NeutralRemark("Sorry, my shoes squeak."),
        NeutralRemark("Oh, the radio is loud.", "the radio"),
        NeutralRemark("Oh, a plate broke.", "a plate"),
        NeutralRemark("Oh, the bell rang.", "the bell"),
        NeutralRemark("Sorry, Grandma called."),
        NeutralRemark("Oh, the dog is barking.", "the dog"),
        NeutralRemark("Oh, it is late already."),
        NeutralRemark("Sorry, this chair squeaks.", "this chair"),
        NeutralRemark("Oh, I forgot lunch."),
        NeutralRemark("Oh, the lamp is off.", "the lamp"),
        NeutralRemark("Oh, the window is open.", "the window"),
        NeutralRemark("Oh, the table is wet.", "the table"),
        NeutralRemark("Sorry, I have a cold."),
        NeutralRemark("Oh, my watch is slow.", "my watch"),
    ),
    test=(
        NeutralRemark("Ah, the tea is hot.", "the tea"),
        NeutralRemark("Hm, I am tired."),
        NeutralRemark("Ah, it is snowing."),
        NeutralRemark("Ah, the alarm rang.", "the alarm"),
        NeutralRemark("Hm, I feel cold."),
        NeutralRemark("Ah, the kids are home."),
        NeutralRemark("Hm, I missed lunch."),
        NeutralRemark("Ah, Mom called."),
        NeutralRemark("Ah, the soup is ready.", "the soup"),
        NeutralRemark("Ah, a cat meowed.", "a cat"),
        NeutralRemark("Hm, Ella called."),
        NeutralRemark("Ah, the clock is slow.", "the clock"),
        NeutralRemark("Ah, my pencil fell.", "my pencil"),
        NeutralRemark("Hm, the door is open.", "the door"),
        NeutralRemark("Ah, Tom called."),
        NeutralRemark("Ah, Ann called."),
        NeutralRemark("Hm, I feel hungry."),
        NeutralRemark("Ah, the heating is on.", "the heating"),
        NeutralRemark("Hm, dinner smells good."),
        NeutralRemark("Ah, a cup fell.", "a cup"),
        NeutralRemark("Hm, a bell rang.", "a bell"),
        NeutralRemark("Ah, the bread is ready.", "the bread"),
        NeutralRemark("Ah, the sun is out."),
        NeutralRemark("Ah, the doorbell rang.", "the doorbell"),
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
        "Now, please help.",
        "Here is the job.",
        "Okay, please help.",
        "So, please help.",
        "Anyway, please help.",
    ),
    test=(
        "Anyway, here goes.",
        "Well, here goes.",
        "Now to my request.",
        "Okay, here goes.",
        "Now, my request.",
    ),
)

"""Introductions: sentences that name the values of a goal, by type of slot."""

from __future__ import annotations

from roboirg.core.word_pools import Pools

COLOR_INTRODUCTIONS = Pools(
    train=(
        "I like {things}.",
        "{things} [is|are] my favorite[|s].",
        "My daughter loves {things}.",
        "I love {things}.",
        "I often use {things}.",
        "{things} [looks|look] nice.",
    ),
    test=(
        "My favorite[|s] [is|are] {things}.",
        "I am fond of {things}.",
        "{things} caught my eye.",
        "My son adores {things}.",
        "I am proud of {things}.",
        "{things} [makes|make] me happy.",
    ),
)
NUMBER_INTRODUCTIONS = Pools(
    train=(
        "The bell rang {times}.",
        "I always knock {times}.",
        "My phone rang {times}.",
        "The clock struck {times}.",
        "My dog barked {times}.",
    ),
    test=(
        "The owl called {times}.",
        "My alarm rang {times}.",
        "The train stopped {times}.",
        "I clapped {times}.",
        "The door opened {times}.",
    ),
)
AMOUNT_INTRODUCTIONS = Pools(
    train=(
        "My daughter wants {things}.",
        "I am thinking of {things}.",
        "My friend needs {things}.",
        "I promised Ben {things}.",
        "Dad wants {things}.",
    ),
    test=(
        "My son asked for {things}.",
        "I have plans for {things}.",
        "We could use {things}.",
        "Mom wants {things}.",
        "I need {things}.",
    ),
)
REFERENCE_AMOUNT_INTRODUCTIONS = Pools(
    train=(
        "Yesterday I saw {things}.",
        "My nephew owns {things}.",
        "Grandpa made {things}.",
        "I gave away {things}.",
    ),
    test=(
        "My niece has {things}.",
        "I recently bought {things}.",
        "The picture shows {things}.",
        "At home I have {things}.",
    ),
)
"""Amounts that only lead to the goal; they may exceed the cubes on the table."""
VISIT_INTRODUCTIONS = Pools(
    train=(
        "I am waiting for {which}.",
        "My money is on {which}.",
        "{which} matters to me.",
        "I have my eye on {which}.",
    ),
    test=(
        "I look forward to {which}.",
        "Everyone is waiting for {which}.",
        "{which} is my favorite.",
        "I care about {which}.",
    ),
)
PLACEMENT_INTRODUCTIONS = Pools(
    train=(
        "I liked {which} in the video.",
        "{which} in the video was neat.",
        "I keep thinking about {which}.",
        "In the video I noticed {which}.",
    ),
    test=(
        "{which} in the video impressed me.",
        "I enjoyed {which} most.",
        "My favorite was {which}.",
        "I clearly remember {which}.",
    ),
)
MOMENT_INTRODUCTIONS = Pools(
    train=(
        "I liked the part {moment}.",
        "The part {moment} was fun.",
        "I remember the part {moment}.",
        "What happened {moment} was neat.",
    ),
    test=(
        "I enjoyed the moment {moment}.",
        "The moment {moment} was great.",
        "I keep thinking of the moment {moment}.",
        "What I saw {moment} impressed me.",
    ),
)
PLACE_INTRODUCTIONS = Pools(
    train=(
        "I like {things}.",
        "I love {things}.",
        "I see {things}.",
        "I am watching {things}.",
        "We can see {things}.",
        "My wife likes {things}.",
        "We all like {things}.",
        "My boss likes {things}.",
        "I often watch {things}.",
        "I really like {things}.",
        "I quite like {things}.",
        "They all like {things}.",
        "She likes {things}.",
        "He likes {things}.",
        "My cat likes {things}.",
        "I want {things}.",
        "I still like {things}.",
        "We often see {things}.",
        "Grandma likes {things}.",
        "I adore {things}.",
        "My twin likes {things}.",
        "My dad likes {things}.",
        "My neighbor likes {things}.",
        "I prefer {things}.",
        "{things} caught my eye.",
    ),
    test=(
        "I spotted {things}.",
        "I noticed {things}.",
        "I pointed at {things}.",
        "I mean {things}.",
        "My aunt likes {things}.",
        "Mom is watching {things}.",
        "Everyone likes {things}.",
        "I just noticed {things}.",
        "I can see {things}.",
        "I always liked {things}.",
        "My uncle likes {things}.",
        "My friend likes {things}.",
        "We prefer {things}.",
        "I picked {things}.",
        "People like {things}.",
        "I found {things}.",
        "Our guest likes {things}.",
        "I remember {things}.",
        "Many people like {things}.",
        "Some people prefer {things}.",
        "My niece likes {things}.",
        "My cousin likes {things}.",
        "Dad is watching {things}.",
        "I chose {things}.",
        "{things} stand[s|] out.",
        "{things} look[s|] nice.",
    ),
)

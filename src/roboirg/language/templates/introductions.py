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
        "My son really likes {things}.",
        "Look at {things}.",
        "{things} [is|are] perfect.",
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
        "I see {things}.",
        "Look at {things}.",
        "I am looking at {things}.",
        "We can see {things}.",
        "I am watching {things}.",
        "I want {things}.",
        "We all see {things}.",
        "I am asking about {things}.",
        "Note {things}.",
        "I have my eye on {things}.",
        "I am pointing at {things}.",
        "I am thinking of {things}.",
        "I need {things}.",
        "I would like {things}.",
        "I like {things}.",
        "I prefer {things}.",
        "We need {things}.",
        "We want {things}.",
        "I am interested in {things}.",
        "Keep an eye on {things}.",
        "I really like {things}.",
        "We are looking at {things}.",
        "We both see {things}.",
        "Have a look at {things}.",
        "{things} caught my eye.",
    ),
    test=(
        "I spotted {things}.",
        "I noticed {things}.",
        "I pointed at {things}.",
        "I mean {things}.",
        "I just noticed {things}.",
        "I can see {things}.",
        "I picked {things}.",
        "I found {things}.",
        "I chose {things}.",
        "I am pointing out {things}.",
        "This is about {things}.",
        "Consider {things}.",
        "My eyes are on {things}.",
        "I have found {things}.",
        "I have chosen {things}.",
        "I decided on {things}.",
        "I care about {things}.",
        "I am talking about {things}.",
        "My choice [is|are] {things}.",
        "Everyone can see {things}.",
        "I selected {things}.",
        "I went for {things}.",
        "I have noticed {things}.",
        "I just spotted {things}.",
        "{things} stand[s|] out.",
        "{things} look[s|] nice.",
    ),
)

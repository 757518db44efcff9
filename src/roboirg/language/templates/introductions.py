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
        "I enjoy {things}.",
        "{things} caught my eye.",
        "My son likes {things}.",
        "Look at {things}.",
        "{things} [is|are] perfect.",
    ),
)
NUMBER_INTRODUCTIONS = Pools(
    train=(
        "Yesterday we tried {times}.",
        "My sister did this {times}.",
        "You did this {times}.",
        "Dad tried this {times}.",
        "We did this {times}.",
    ),
    test=(
        "We tested this {times}.",
        "My brother did this {times}.",
        "You tried this {times}.",
        "Mom tried this {times}.",
        "Tom did this {times}.",
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
        "I am interested in {which}.",
        "{which} matters to me.",
        "Watch out for {which}.",
    ),
    test=(
        "Get ready for {which}.",
        "Everyone is waiting for {which}.",
        "{which} is important.",
        "I am thinking of {which}.",
    ),
)
REFERENCE_VISIT_INTRODUCTIONS = Pools(
    train=(
        "My sister bet on {which}.",
        "Dad is waiting for {which}.",
        "My brother picked {which}.",
        "Grandma likes {which}.",
    ),
    test=(
        "My aunt bet on {which}.",
        "Mom is waiting for {which}.",
        "My uncle picked {which}.",
        "Grandpa likes {which}.",
    ),
)
"""Visits that only lead to the goal."""
PLACEMENT_INTRODUCTIONS = Pools(
    train=(
        "Think of {which} in the video.",
        "{which} in the video matters.",
        "I am thinking of {which}.",
        "In the video I noticed {which}.",
    ),
    test=(
        "{which} in the video is important.",
        "I watched {which} closely.",
        "In the video I liked {which}.",
        "Remember {which} in the video.",
    ),
)
REFERENCE_PLACEMENT_INTRODUCTIONS = Pools(
    train=(
        "My sister liked {which} in the video.",
        "Dad noticed {which}.",
        "My brother picked {which}.",
        "In the video Grandma liked {which}.",
    ),
    test=(
        "My aunt liked {which} in the video.",
        "Mom noticed {which}.",
        "My uncle picked {which}.",
        "In the video Grandpa liked {which}.",
    ),
)
"""Placements that only lead to the goal."""
MOMENT_INTRODUCTIONS = Pools(
    train=(
        "Think of what happened {moment}.",
        "The video shows a placement {moment}.",
        "Think of the moment {moment}.",
        "I watched closely {moment}.",
    ),
    test=(
        "Remember the moment {moment}.",
        "The moment {moment} is important.",
        "I watched what happened {moment}.",
        "What happened {moment} matters.",
    ),
)
PLACE_INTRODUCTIONS = Pools(
    train=(
        "I see {things}.",
        "Look at {things}.",
        "I am looking at {things}.",
        "We can see {things}.",
        "I will need {things}.",
        "I want {things}.",
        "I was looking at {things}.",
        "I am talking about {things}.",
        "I was thinking of {things}.",
        "I have my eye on {things}.",
        "I am pointing at {things}.",
        "I am thinking of {things}.",
        "I need {things}.",
        "I would like {things}.",
        "I like {things}.",
        "I prefer {things}.",
        "We need {things}.",
        "We want {things}.",
        "I could use {things}.",
        "Keep an eye on {things}.",
        "I really like {things}.",
        "We are looking at {things}.",
        "Let's use {things}.",
        "Have a look at {things}.",
        "{things} caught my eye.",
    ),
    test=(
        "I spotted {things}.",
        "I noticed {things}.",
        "I have in mind {things}.",
        "I mean {things}.",
        "I just noticed {things}.",
        "I can see {things}.",
        "I picked {things}.",
        "I found {things}.",
        "I chose {things}.",
        "I meant {things}.",
        "This is about {things}.",
        "Think about {things}.",
        "I was talking about {things}.",
        "I have found {things}.",
        "I have chosen {things}.",
        "I decided on {things}.",
        "I was pointing at {things}.",
        "I have decided on {things}.",
        "My choice[|s] [is|are] {things}.",
        "I am looking for {things}.",
        "I settled on {things}.",
        "I asked about {things}.",
        "I have noticed {things}.",
        "I just spotted {things}.",
        "{things} stand[s|] out.",
        "{things} look[s|] nice.",
    ),
)

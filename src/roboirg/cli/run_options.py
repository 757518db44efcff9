"""The options of a plan. They have no defaults here, because a plan file may set them.

Help texts give the default in parentheses.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from roboirg.cli.options import OptionGroup

EPISODES, WORDS, PLAY = "Which episodes", "Which words", "How they are played"
"""Panels of the help; narrow terminals have room for every name in them."""

_episodes = partial(typer.Option, rich_help_panel=EPISODES)
_words = partial(typer.Option, rich_help_panel=WORDS)
_play = partial(typer.Option, rich_help_panel=PLAY)


class PlanChoices(OptionGroup):
    """The fields of a plan that are used daily; a plan file has all."""

    policies: Annotated[
        list[str] | None,
        _episodes(
            "--policy",
            help="Built-in name, package.module:Class or address, or NAME=one of these; "
            "repeatable.",
        ),
    ]
    tasks: Annotated[
        str | None,
        _episodes(help="Tasks or suites, separated by commas; all for the whole benchmark.  (all)"),
    ]
    settings: Annotated[
        str | None,
        _episodes(
            help="Settings, separated by commas; all for the five main ones, every for the "
            "harder ones too.  (all)"
        ),
    ]
    forms: Annotated[
        str | None, _episodes(help="implicit, resolved, or both separated by a comma.  (implicit)")
    ]
    split: Annotated[str | None, _episodes(help="train, val, test or random.  (test)")]
    episodes: Annotated[
        str | None,
        _episodes(
            help="all, 4 for the first four, a list such as 0,3,5-9, or easy,medium,hard.  (4)"
        ),
    ]
    policy_seeds: Annotated[
        str | None,
        _episodes(help="Seeds, separated by commas; every seed plays every episode.  (0)"),
    ]
    arms: Annotated[
        str | None,
        _episodes(
            help="told, and control arms of the same scenes: other-goal, silent, scrambled, "
            "paraphrase:2, again.  (told)"
        ),
    ]
    stages: Annotated[
        str | None,
        _words(
            help="Stages of the contextual setting; several sets with semicolons: 1,5;1-5.  (1-5)"
        ),
    ]
    wordings: Annotated[
        str | None,
        _words(
            help="train or test for our words of that pool, or a wording file.  (ours of the split)"
        ),
    ]
    max_steps: Annotated[int | None, _play(help="Limit in control steps, 20 per second.  (1300)")]
    max_cost: Annotated[
        float | None,
        _play(help="Most US dollars that models may cost; then the run stops and can be resumed."),
    ]
    video: Annotated[
        str | None, _play(help="Record videos of episodes: off, failures or all.  (off)")
    ]


NO_CHOICES = PlanChoices()

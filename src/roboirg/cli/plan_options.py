"""The options of a plan. They have no defaults here, because a plan file may set them.

Help texts give the default in parentheses.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, NamedTuple

import typer

EPISODES, WORDS, SENSES, POLICIES, ERRORS = (
    "Which episodes", "Which words", "Actions, observations, videos", "Policies",
    "Time limits and errors",
)  # fmt: skip
"""Panels of the help; narrow terminals have room for every name in them."""

_episodes = partial(typer.Option, rich_help_panel=EPISODES)
_words = partial(typer.Option, rich_help_panel=WORDS)
_senses = partial(typer.Option, rich_help_panel=SENSES)
_policies = partial(typer.Option, rich_help_panel=POLICIES)
_errors = partial(typer.Option, rich_help_panel=ERRORS)

Policies = Annotated[
    list[str] | None,
    _policies(
        "--policy",
        help="Built-in name, package.module:Class or address, or NAME=one of these; repeatable.",
    ),
]
Tasks = Annotated[
    str | None,
    _episodes(help="Tasks or suites, separated by commas; all for the whole benchmark.  (all)"),
]
Settings = Annotated[
    str | None,
    _episodes(help="Settings, separated by commas; all for every setting of each task.  (all)"),
]
Forms = Annotated[
    str | None, _episodes(help="implicit, resolved, or both separated by a comma.  (implicit)")
]
Split = Annotated[str | None, _episodes(help="train, val, test or random.  (test)")]
Salt = Annotated[
    str | None,
    _episodes(
        help="Secret that draws private episodes of --split random.  (ROBOIRG_SALT, or none)"
    ),
]
Episodes = Annotated[
    str | None, _episodes(help="all, 4 for the first four, or a list such as 0,3,5-9.  (4)")
]
PolicySeeds = Annotated[
    str | None,
    _episodes(help="Seeds, separated by commas; every seed plays every episode.  (0)"),
]
Stages = Annotated[
    str | None,
    _words(help="Stages of the contextual setting; several sets with semicolons: 1,5;1-5.  (1-5)"),
]
Distractor = Annotated[
    str | None,
    _words(help="Distractors of the contextual setting: neutral or competing.  (neutral)"),
]
Distractors = Annotated[
    int | None, _words(help="Number of distractors in the contextual setting.  (1)")
]
Frame = Annotated[
    str | None,
    _words(help="Frame of reference of the spatial setting: robot or camera.  (robot)"),
]
Delivery = Annotated[
    str | None,
    _words(
        help="prompt: the whole instruction at once; turns: one utterance after another.  (prompt)"
    ),
]
Wordings = Annotated[
    str | None,
    _words(help="Our words for train or test, or a file with commands.  (ours of the split)"),
]
MaxSteps = Annotated[int | None, _episodes(help="Limit in control steps, 20 per second.  (1300)")]
Actions = Annotated[str | None, _senses(help="Required action space.  (the policy's own)")]
DemonstrationFrames = Annotated[
    str | None,
    _senses(help="Frames of the demonstration: all, none, or a number.  (the policy's choice)"),
]
ObserveEvery = Annotated[
    int | None,
    _senses(help="Record an observation every N control steps.  (the policy's choice)"),
]
Meshes = Annotated[str | None, _senses(help="Meshes for rendering: faithful or light.  (faithful)")]
Video = Annotated[
    str | None, _senses(help="Record videos of episodes: off, failures or all.  (off)")
]
PolicyProcessOption = Annotated[
    str | None,
    _policies(
        "--policy-process",
        help="own: policies have processes of their own; shared: the world's, to debug.  (own)",
    ),
]
Batch = Annotated[
    int | None, _policies(help="Most episodes that a policy is asked about at once.  (16)")
]
Devices = Annotated[
    str | None,
    _policies(help="GPUs, such as 0,1; each policy has a process on each.  (one, on any)"),
]
LongPrompts = Annotated[
    str | None,
    _policies(
        help="Episodes whose prompt is longer than what the policy reads: send or refuse.  (send)"
    ),
]
PolicyTimeout = Annotated[
    float | None, _errors(help="Time limit of one policy call, seconds.  (600)")
]
EpisodeTimeout = Annotated[float | None, _errors(help="Time limit of an episode, seconds.  (7200)")]
Tries = Annotated[
    int | None,
    _errors(help="Attempts per episode if it ends in an error listed in --retry-on.  (2)"),
]
RetryOn = Annotated[
    str | None,
    _errors(help="Kinds of errors to retry, or none.  (connection, environment, infrastructure)"),
]


class PlanChoices(NamedTuple):
    """The options of a plan; a parameter of commands, see `roboirg.cli.options.spread`."""

    policies: Policies = None
    tasks: Tasks = None
    settings: Settings = None
    forms: Forms = None
    split: Split = None
    episodes: Episodes = None
    policy_seeds: PolicySeeds = None
    stages: Stages = None
    distractor: Distractor = None
    distractors: Distractors = None
    frame: Frame = None
    delivery: Delivery = None
    wordings: Wordings = None
    max_steps: MaxSteps = None
    actions: Actions = None
    demonstration_frames: DemonstrationFrames = None
    observe_every: ObserveEvery = None
    meshes: Meshes = None
    video: Video = None
    policy_process: PolicyProcessOption = None
    batch: Batch = None
    devices: Devices = None
    long_prompts: LongPrompts = None
    policy_timeout_s: PolicyTimeout = None
    episode_timeout_s: EpisodeTimeout = None
    tries: Tries = None
    retry_on: RetryOn = None

    def typed(self) -> dict[str, Any]:
        """Return those that were typed, by name."""
        return {name: value for name, value in self._asdict().items() if value not in (None, [])}


NO_CHOICES = PlanChoices()

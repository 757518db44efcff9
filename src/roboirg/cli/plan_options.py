"""The options of a plan: each may stand in a plan file instead, so none has a default here.

In brackets is what holds if neither says anything.
"""

from __future__ import annotations

from typing import Annotated

import typer

Tasks = Annotated[
    str | None, typer.Option(help="Names of tasks or suites separated by commas, or all.  (all)")
]
Settings = Annotated[
    str | None, typer.Option(help="Names separated by commas, or all that a task has.  (all)")
]
Forms = Annotated[
    str | None, typer.Option(help="implicit, resolved, or both with a comma.  (implicit)")
]
Split = Annotated[str | None, typer.Option(help="train, val or test.  (test)")]
Episodes = Annotated[
    str | None, typer.Option(help="4: the first four; or a list such as 0,3,5-9.  (4)")
]
PolicySeeds = Annotated[
    str | None, typer.Option(help="A list of numbers; each plays every episode.  (0)")
]
Stages = Annotated[
    str | None,
    typer.Option(help="Stages of the contextual setting; several sets as 1,5;1-5.  (1-5)"),
]
Distractor = Annotated[
    str | None, typer.Option(help="Kind of distractor in the contextual setting.  (neutral)")
]
Distractors = Annotated[
    int | None, typer.Option(help="How many distractors are spoken there.  (1)")
]
Frame = Annotated[
    str | None, typer.Option(help="Frame of reference in the spatial setting.  (robot)")
]
MaxSteps = Annotated[
    int | None, typer.Option(help="The policy's limit in control steps, 20 a second.  (1300)")
]
Actions = Annotated[
    str | None, typer.Option(help="The action space to be played in.  (the policy's)")
]
DemonstrationFrames = Annotated[
    str | None, typer.Option(help="Pictures of the video: all, none or n.  (as the policy says)")
]
ObserveEvery = Annotated[
    int | None, typer.Option(help="A picture after every n-th control step.  (as the policy says)")
]
Meshes = Annotated[str | None, typer.Option(help="faithful or light.  (faithful)")]
Video = Annotated[
    str | None, typer.Option(help="Which episodes to film: off, failures or all.  (off)")
]
PolicyTimeout = Annotated[
    float | None, typer.Option(help="Seconds that a call of a policy may take.  (600)")
]
EpisodeTimeout = Annotated[
    float | None, typer.Option(help="Seconds that an episode may take.  (7200)")
]
Tries = Annotated[
    int | None,
    typer.Option(help="How often an episode is tried that ends in an error of --retry-on.  (2)"),
]
RetryOn = Annotated[
    str | None,
    typer.Option(
        help="Kinds of errors to try again, or none.  (connection,environment,infrastructure)"
    ),
]

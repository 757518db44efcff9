"""Options that several commands have."""

from __future__ import annotations

from typing import Annotated

import typer

Tasks = Annotated[
    str,
    typer.Option(help="Names of tasks or suites, separated by commas, or all of the benchmark."),
]
Settings = Annotated[str, typer.Option(help="Names separated by commas, or all that a task has.")]
Forms = Annotated[str, typer.Option(help="implicit, resolved, or both with a comma.")]
Split = Annotated[str, typer.Option(help="train, val or test.")]
Video = Annotated[str, typer.Option(help="Which episodes to film: off, failures or all.")]
AnySplit = Annotated[str, typer.Option(help="train, val, test or all.")]
Stages = Annotated[str, typer.Option(help="Stages of the contextual setting, such as 1,5.")]
Distractor = Annotated[str, typer.Option(help="Kind of distractor in the contextual setting.")]
Frame = Annotated[str, typer.Option(help="Frame of reference in the spatial setting.")]
Workers = Annotated[
    int | None,
    typer.Option(help="Processes; by default one per core. 0 works in this process."),
]

"""Options shared by several commands, and checks of their values."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboirg.core.errors import InvalidValueError

Tasks = Annotated[
    str,
    typer.Option(help="Tasks or suites, separated by commas; all for the whole benchmark."),
]
Settings = Annotated[str, typer.Option(help="Settings, separated by commas; all for every one.")]
Forms = Annotated[str, typer.Option(help="implicit, resolved, or both separated by a comma.")]
Split = Annotated[str, typer.Option(help="train, val, test or random.")]
Video = Annotated[str, typer.Option(help="Record videos of episodes: off, failures or all.")]
AnySplit = Annotated[str, typer.Option(help="train, val, test or all.")]
Stages = Annotated[str, typer.Option(help="Stages of the contextual setting, such as 1,5.")]
Distractor = Annotated[str, typer.Option(help="Kind of distractor in the contextual setting.")]
Frame = Annotated[str, typer.Option(help="Frame of reference in the spatial setting.")]
Rival = Annotated[
    str, typer.Option(help="A second value in direct, contextual, spatial: none or drawn.")
]
Reasoning = Annotated[str, typer.Option(help="Patterns of the reasoning setting: plain or open.")]
Wordings = Annotated[
    str | None,
    typer.Option(
        help="Wording file whose commands are used instead of our own; or train or test: our words "
        "of that pool in every split."
    ),
]
Salt = Annotated[
    str | None,
    typer.Option(help="Secret of a private split; not in the shell's history if in ROBOIRG_SALT."),
]
Workers = Annotated[
    int | None,
    typer.Option(help="Worker processes, one per core by default; 0 uses this process only."),
]


def check_output_file(path: Path) -> None:
    """Check early that a file can be written there.

    Raises:
        InvalidValueError: it is a folder, or its folder does not exist.
    """
    if path.is_dir() or not path.parent.is_dir():
        raise InvalidValueError(f"{str(path)!r} is not a file in an existing folder.")

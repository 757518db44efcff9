"""Options shared by several commands, and checks of their values."""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, get_type_hints

import typer

from roboirg.core.errors import InvalidValueError

if TYPE_CHECKING:
    from roboirg.core.instruction_options import InstructionOptions

Tasks = Annotated[
    str,
    typer.Option(help="Tasks or suites, separated by commas; all for the whole benchmark."),
]
Settings = Annotated[
    str,
    typer.Option(help="Settings, separated by commas; all for every one but the harder ones."),
]
Forms = Annotated[str, typer.Option(help="implicit, resolved, or both separated by a comma.")]
Split = Annotated[str, typer.Option(help="train, val, test or random.")]
Video = Annotated[str, typer.Option(help="Record videos of episodes: off, failures or all.")]
AnySplit = Annotated[str, typer.Option(help="train, val, test or all.")]
Stages = Annotated[str, typer.Option(help="Stages of the contextual setting, such as 1,5.")]
Distractor = Annotated[str, typer.Option(help="Kind of distractor in the contextual setting.")]
Frame = Annotated[str, typer.Option(help="Frame of reference in the spatial setting.")]
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


class WordChoices(NamedTuple):
    """Options that choose the words of instructions; a parameter of commands, see `spread`."""

    stages: Stages = "1-5"
    distractor: Distractor = "neutral"
    frame: Frame = "robot"
    wordings: Wordings = None

    def instruction_options(self, delivery: str = "prompt") -> InstructionOptions:
        """Return them checked one by one; `check_options` checks whether they go together.

        Raises:
            InvalidValueError: there is no such stage, or the wording file cannot be read.
        """
        from roboirg.core.instruction_options import InstructionOptions
        from roboirg.evaluation.plan.plan_parsing import parse_stages
        from roboirg.language.wordings.wording_store import open_wordings

        chosen = self._asdict() | {
            "stages": parse_stages(self.stages),
            "wordings": open_wordings(self.wordings),
        }
        return InstructionOptions(**chosen, delivery=delivery)


DEFAULT_WORDS = WordChoices()


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """Let a parameter that is a named tuple of options be given as an option for each field."""
    types = get_type_hints(command, include_extras=True)
    groups = {name: kind for name, kind in types.items() if hasattr(kind, "_field_defaults")}
    parameters: list[inspect.Parameter] = []
    for one in inspect.signature(command).parameters.values():
        kind = groups.get(one.name)
        if kind is None:
            parameters.append(one.replace(annotation=types[one.name]))
            continue
        fields = get_type_hints(kind, include_extras=True)
        parameters += [
            one.replace(name=name, annotation=fields[name], default=default)
            for name, default in kind._field_defaults.items()
        ]

    @functools.wraps(command)
    def spread_command(**given: Any) -> None:  # noqa: ANN401 - whatever the command takes
        chosen = {
            name: kind(*(given.pop(field) for field in kind._fields))
            for name, kind in groups.items()
        }
        command(**given, **chosen)

    # Typer reads both.
    spread_command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    spread_command.__annotations__ = {one.name: one.annotation for one in parameters}
    return spread_command


def check_output_file(path: Path) -> None:
    """Check early that a file can be written there.

    Raises:
        InvalidValueError: it is a folder, or its folder does not exist.
    """
    if path.is_dir() or not path.parent.is_dir():
        raise InvalidValueError(f"{str(path)!r} is not a file in an existing folder.")


def add_working_directory() -> None:
    """Add the working directory to the import path, as `python -m` does."""
    sys.path.insert(0, str(Path.cwd()))

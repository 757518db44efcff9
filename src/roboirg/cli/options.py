"""Options shared by several commands, and checks of their values."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer

from roboirg.cli.names import known_names, known_settings, known_tasks
from roboirg.core.errors import InvalidValueError, check_names

if TYPE_CHECKING:
    from roboirg.core.instruction_options import InstructionOptions

Tasks = Annotated[
    str,
    typer.Option(help="Tasks or suites, separated by commas."),
]
Settings = Annotated[
    str,
    typer.Option(
        help="Comma-separated settings; all means the five main ones, every adds the rest."
    ),
]
Split = Annotated[str, typer.Option(help="train, val, test or random.")]
AnySplit = Annotated[str, typer.Option(help="train, val, test or all.")]
Workers = Annotated[
    int | None,
    typer.Option(
        help="Worker processes; 0 works in this process.  (ROBOIRG_WORKERS, or one per core)"
    ),
]

PlanName = Annotated[
    str | None,
    typer.Option(
        "--plan",
        help="Plan that sets the words and the defaults of these options (see roboirg run "
        "--show-plan).",
    ),
]


class PlanWords:
    """What a command other than `run` takes from the file of its option `--plan`.

    Args:
        context: of the command.
        plan: name of the file, if there is one.
        section: key in the file for choices of its own for which the command has no options.
        own: names of these choices.
    """

    def __init__(
        self,
        context: typer.Context,
        plan: str | None,
        section: str = "",
        own: Sequence[str] = (),
    ) -> None:
        """Read the plan's file, if one is named; `fields` is what stands in it, else empty.

        Args:
            context: of the command, which knows what was typed.
            plan: name of a plan or its file.
            section: key of the part of the file that belongs to this command alone.
            own: keys that this part may have.
        """
        from roboirg.runs.plan.plan_file import read_plan_file

        self._context = context
        self._section = section
        self._own = own
        self.fields = {} if plan is None else read_plan_file(plan, section)

    def given(self, name: str, value: str) -> Any:  # noqa: ANN401 - as in the file
        """Return the value of an option of the command; if it was not typed, as in the plan.

        Args:
            name: of the option, and of the plan's field.
            value: of the option, its default if it was not typed.
        """
        source = self._context.get_parameter_source(name)
        is_typed = source is not None and source.name != "DEFAULT"
        return value if is_typed else self.fields.get(name, value)

    def tasks(self, typed: str = "all", wordings: str | None = None) -> tuple[str, ...]:
        """Return the names of tasks that were typed, or else those of the plan.

        With open wordings (words that others wrote), ``all`` means the tasks that they have words
        of.
        """
        return known_tasks(self.given("tasks", typed), wordings)

    def settings(self, typed: str = "all", tasks: Sequence[str] = ()) -> tuple[str, ...]:
        """Return the names of settings that were typed, or else those of the plan.

        The tasks must have each that is named.
        """
        return known_settings(self.given("settings", typed), tasks)

    def choices(self, kind: type) -> dict[str, Any]:
        """Return the values in this command's section of the plan that are fields of a class.

        Of a section ``{"size": "8", "name": "a"}``, a class with the field ``size: int`` gets
        ``{"size": 8}``.

        Raises:
            UnknownNameError: a key is none of its own.
            InvalidValueError: a value is not of the field's type.
        """
        from roboirg.runs.plan.plan_maker import as_typed_field

        given = self.fields.get(self._section, {})
        if not isinstance(given, Mapping):
            raise InvalidValueError(
                f"{self._section} of the plan is {given!r}; it must be a mapping such as "
                f"'{self._own[0]}: …'."
            )
        check_names(f"key of {self._section} in the plan", given, self._own)
        types = get_type_hints(kind, include_extras=True)
        choices: dict[str, Any] = {}
        for name, value in given.items():
            if name in types:
                choices[name] = as_typed_field(f"{self._section}.{name}", types[name], value)
        return choices

    def options(self) -> InstructionOptions:
        """Return the options of instructions that the plan gives, other than setting and form.

        ``{"tasks": "all", "stages": "1,5"}`` gives options with these stages; tasks are no option
        of instructions. Options may stand alone in the plan, or in its section ``instruction``.
        Each is checked by itself; `check_options` checks whether they go together.
        """
        from roboirg.runs.plan.plan_fields import FLAT
        from roboirg.runs.plan.plan_maker import word_options

        names = {"stages", "wordings", "instruction"}
        # `FLAT` has the section of each option that may also stand outside of it.
        names.update(name for name, section in FLAT.items() if section == "instruction")
        chosen = {name: value for name, value in self.fields.items() if name in names}
        return word_options(**chosen)

    def forms(self, usual: Sequence[str] = ("implicit",)) -> tuple[str, ...]:
        """Return the plan's forms, or the usual ones if it has none."""
        from roboirg.language import FORMS
        from roboirg.runs.plan.option_parsing import parse_forms

        return known_names("form", parse_forms(self.fields.get("forms", usual)), FORMS)

    def form(self) -> str:
        """Return the plan's only form."""
        found = self.forms()
        if len(found) > 1:
            raise InvalidValueError(
                f"The plan's forms are {' and '.join(found)}; this command needs exactly one."
            )
        return found[0]


def check_output_file(path: Path) -> None:
    """Check early that a file can be written there.

    Raises:
        InvalidValueError: it is a folder, or its folder does not exist.
    """
    if path.is_dir() or not path.parent.is_dir():
        raise InvalidValueError(f"{str(path)!r} is not a file in an existing folder.")


def add_working_directory(*, last: bool = False) -> None:
    """Add the working directory to the import path, as `python -m` does.

    Args:
        last: whether it comes last, so that a file there replaces no installed module; for
            commands whose processes hold worlds.
    """
    place = len(sys.path) if last else 0
    sys.path.insert(place, str(Path.cwd()))

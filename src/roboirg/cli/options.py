"""Options shared by several commands, and checks of their values."""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, get_origin, get_type_hints

import typer

from roboirg.cli.names import known_names
from roboirg.core.errors import InvalidValueError, UnknownNameError

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


_CONTEXT, _KEYWORD = "context", inspect.Parameter.KEYWORD_ONLY


class OptionGroup:
    """Options of a command that are one parameter of its function; see `spread`.

    A subclass names its options as annotations. None of them has a default of its own.
    """

    def __init__(self, **given: Any) -> None:  # noqa: ANN401 - whatever its options take
        self._given = given

    @classmethod
    def types(cls) -> dict[str, Any]:
        """Return the annotation of each option."""
        found = get_type_hints(cls, include_extras=True)
        return {name: kind for name, kind in found.items() if get_origin(kind) is not ClassVar}

    def typed(self) -> dict[str, Any]:
        """Return those that were typed, by name."""
        return {name: value for name, value in self._given.items() if value not in (None, [])}


class WordOptions(OptionGroup):
    """The options of one instruction, each an option of the command."""

    @classmethod
    def types(cls) -> dict[str, Any]:
        """Return the annotation of each; the command chooses settings and forms itself."""
        from roboirg.core.instruction_options import OPTION_HELP, InstructionOptions

        usual = InstructionOptions()
        return {
            name: Annotated[
                (int if isinstance(getattr(usual, name), int) else str) | None,
                typer.Option(help=text),
            ]
            for name, text in OPTION_HELP.items()
            if name not in ("setting", "form", "delivery")
        }

    def options(self) -> InstructionOptions:
        """Return them checked one by one; `check_options` checks whether they go together."""
        from roboirg.evaluation.plan.plan_maker import word_options

        return word_options(**self.typed())


PlanName = Annotated[
    str | None,
    typer.Option(
        "--plan",
        help="Plan that sets the words and the defaults of these options (see roboirg run "
        "--show-plan).",
    ),
]
SELECTION = ("tasks", "split", "episodes", "settings")
"""Options of commands with `PlanWords` that a plan gives, too."""


class PlanWords(OptionGroup):
    """The options of instructions, as a plan gives them.

    The class of a command may name a section of the plan's file, and what this may have: choices
    of its own for which the command has no options.
    """

    plan: PlanName
    section: ClassVar[str] = ""
    own: ClassVar[Sequence[str]] = ()

    @functools.cached_property
    def fields(self) -> dict[str, Any]:
        """The plan's fields as options of `make_plan`; empty without a plan."""
        from roboirg.evaluation.plan.plan_file import read_plan_file

        name = self._given.get("plan")
        return {} if name is None else read_plan_file(name, self.section)

    def choices(self, kind: type) -> dict[str, Any]:
        """Return what the plan's section gives of the fields of this class.

        Raises:
            UnknownNameError: a key is none of its own.
            InvalidValueError: a value is not of the field's type.
        """
        from roboirg.evaluation.plan.plan_maker import as_typed_field

        given = self.fields.get(self.section) or {}
        if not isinstance(given, Mapping):
            raise InvalidValueError(
                f"{self.section} of the plan is {given!r}; it must be a mapping such as "
                f"'{self.own[0]}: …'."
            )
        for name in given:
            if name not in self.own:
                raise UnknownNameError(f"key of {self.section} in the plan", str(name), self.own)
        types = get_type_hints(kind, include_extras=True)
        return {
            name: as_typed_field(f"{self.section}.{name}", types[name], value)
            for name, value in given.items()
            if name in types
        }

    @property
    def words(self) -> dict[str, Any]:
        """Those of them that choose the words of each setting and form."""
        from roboirg.evaluation.plan.plan import SINGLE_OPTIONS

        names = ("stages", "wordings", "options", *SINGLE_OPTIONS)
        return {name: self.fields[name] for name in names if name in self.fields}

    @property
    def wordings_file(self) -> str | None:
        """The wording file or the name of a pool."""
        return self.fields.get("wordings")

    def options(self) -> InstructionOptions:
        """Return them checked one by one; `check_options` checks whether they go together."""
        from roboirg.evaluation.plan.plan_maker import word_options

        return word_options(**self.words)

    def forms(self, usual: Sequence[str] = ("implicit",)) -> tuple[str, ...]:
        """Return the plan's forms, or the usual ones if it has none."""
        from roboirg.language import FORMS

        return known_names("form", self.fields.get("forms", ",".join(usual)), FORMS)

    def form(self) -> str:
        """Return the plan's only form."""
        found = self.forms()
        if len(found) > 1:
            raise InvalidValueError(
                f"The plan's forms are {' and '.join(found)}; this command needs exactly one."
            )
        return found[0]


NO_PLAN = PlanWords()
NO_WORDS = WordOptions()


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """Let each parameter that is a group of options be given as these options."""
    types = get_type_hints(command, include_extras=True)
    groups = {
        name: kind
        for name, kind in types.items()
        if isinstance(kind, type) and issubclass(kind, OptionGroup)
    }
    members = {name: kind.types() for name, kind in groups.items()}
    parameters = [inspect.Parameter(_CONTEXT, _KEYWORD, annotation=typer.Context)]
    for one in inspect.signature(command).parameters.values():
        if one.name not in groups:
            parameters.append(one.replace(annotation=types[one.name], kind=_KEYWORD))
            continue
        parameters += [
            one.replace(name=name, annotation=annotation, default=None, kind=_KEYWORD)
            for name, annotation in members[one.name].items()
        ]

    @functools.wraps(command)
    def spread_command(**given: Any) -> None:  # noqa: ANN401 - whatever the command takes
        context = given.pop(_CONTEXT)
        chosen = {
            name: kind(**{member: given.pop(member) for member in members[name]})
            for name, kind in groups.items()
        }
        for group in chosen.values():
            if isinstance(group, PlanWords):
                given |= _planned(given, group, context)
        command(**given, **chosen)

    # Typer reads both.
    spread_command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    spread_command.__annotations__ = {one.name: one.annotation for one in parameters}
    return spread_command


def _planned(given: Mapping[str, Any], group: PlanWords, context: typer.Context) -> dict[str, Any]:
    """Return the options of a command that a plan gives and that were not typed."""
    shared = [name for name in SELECTION if name in given and name in group.fields]
    sources = {name: context.get_parameter_source(name) for name in shared}
    return {
        name: group.fields[name]
        for name, source in sources.items()
        if source is not None and source.name == "DEFAULT"
    }


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
        last: for commands whose processes hold worlds, which import none of a policy's files.
    """
    sys.path.insert(len(sys.path) if last else 0, str(Path.cwd()))

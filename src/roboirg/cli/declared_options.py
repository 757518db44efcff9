"""Options of commands that are declared elsewhere: fields of a plan, options of instructions."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from dataclasses import fields
from typing import Annotated, Any, get_args, get_origin

import typer
import typer.main
from typer.core import TyperCommand

from roboirg.core.instruction_options import InstructionOptions

EPISODES, WORDS, PLAY = "Which episodes", "Which words", "How they are played"
"""Panels of the help; narrow terminals have room for every name in them."""
_PANELS = {
    EPISODES: (
        "policies", "tasks", "settings", "forms", "split", "episodes", "policy_seeds", "arms",
    ),
    WORDS: ("stages", "wordings"),
    PLAY: ("max_steps", "max_cost", "video"),
}  # fmt: skip
"""The fields of a plan that are used daily; a plan file has all."""


class DeclaredCommand(TyperCommand):
    """A command with options that are declared elsewhere; they are made when they are needed.

    They have no defaults. The function finds those that were typed as its context's ``obj``, by
    name.
    """

    def declared(self) -> Iterator[inspect.Parameter]:
        """Yield the options; see `option`."""
        raise NotImplementedError

    _all: list[Any]
    _made: list[Any]

    @property  # A list that the base class sets, and changes.
    def params(self) -> list[Any]:
        """All options; the declared ones come first."""
        if not self._made:
            self._made = _params_of(list(self.declared()))
            self._all[:0] = self._made
        return self._all

    @params.setter
    def params(self, own: list[Any]) -> None:
        self._all = own
        self._made = []

    def invoke(self, ctx: Any) -> Any:  # noqa: ANN401 - typer does not export its base class
        """Call the function."""
        given = {one.name: ctx.params.pop(one.name) for one in self._made}
        ctx.obj = {name: value for name, value in given.items() if value not in (None, [], ())}
        return super().invoke(ctx)


def _params_of(declared: list[inspect.Parameter]) -> list[Any]:
    """Return parameters of a function as typer's parameters of a command."""

    def command() -> None: ...

    # Typer reads both.
    command.__signature__ = inspect.Signature(declared)  # type: ignore[attr-defined]
    command.__annotations__ = {one.name: one.annotation for one in declared}
    holder = typer.Typer(add_completion=False)
    holder.command()(command)
    return typer.main.get_command(holder).params


def option(
    name: str,
    kind: Any,  # noqa: ANN401 - as typer takes it
    text: str,
    panel: str | None = None,
    *words: str,
) -> inspect.Parameter:
    """Return an option of a command.

    Args:
        name: of the field.
        kind: type of what is typed.
        text: of the help.
        panel: of the help.
        words: its name on the command line, if it is not that of the field.
    """
    declared = typer.Option(*words, help=text, rich_help_panel=panel)
    annotation = Annotated[kind | None, declared]
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation
    )


class RunCommand(DeclaredCommand):
    """The command that plays a plan; plans are imported for its own help only."""

    def declared(self) -> Iterator[inspect.Parameter]:
        """Yield the daily options of a plan; their texts end with the defaults."""
        from roboirg.evaluation.plan.plan import plan_options

        options = {one.name: one for one in plan_options()}
        for panel, names in _PANELS.items():
            for name in names:
                one = options[name]
                kinds = (one.type, *get_args(one.type))
                numbers = (int, float) if get_origin(one.type) is not tuple else ()
                kind = next((kind for kind in numbers if kind in kinds), str)
                text = one.help if one.default is None else f"{one.help}  ({one.default})"
                if name == "policies":
                    yield option(name, list[str], text, panel, "--policy")
                else:
                    yield option(name, kind, text, panel)


class WordsCommand(DeclaredCommand):
    """A command with the options of one instruction; it chooses settings and forms itself."""

    def declared(self) -> Iterator[inspect.Parameter]:
        """Yield the options of an instruction."""
        for one in fields(InstructionOptions):
            if one.name not in ("setting", "form", "delivery"):
                kind = int if isinstance(one.default, int) else str
                yield option(one.name, kind, one.metadata["help"])

"""Options of commands that are declared elsewhere: fields of a plan, options of instructions."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator
from dataclasses import fields
from typing import Annotated, Any

import typer
import typer.main
from typer.core import TyperCommand

from roboirg.core.instruction_options import InstructionOptions

EPISODES = "Which episodes"
WORDS = "Which words"
PLAY = "How they are played"
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

    _all: list[Any]
    _made: list[Any]

    def declared(self) -> Iterator[tuple[str, Any, Any]]:
        """Yield name, type and `typer.Option` of each."""
        raise NotImplementedError

    @property  # A list that the base class sets, and changes.
    def params(self) -> list[Any]:
        """All options; the declared ones come first."""
        if not self._made:
            self._made = _params_of(self.declared())
            self._all[:0] = self._made
        return self._all

    @params.setter
    def params(self, own: list[Any]) -> None:
        self._all = own
        self._made = []

    def invoke(self, ctx: Any) -> Any:  # noqa: ANN401 - typer does not export its base class
        """Call the function of the command with the declared options that were typed.

        They are no arguments of the function, so they are moved from the context's ``params`` to
        its ``obj``: ``--tasks all`` becomes ``{"tasks": "all"}``. Options that were not typed are
        dropped.
        """
        ctx.obj = {}
        for parameter in self._made:
            value = ctx.params.pop(parameter.name)
            is_typed = value not in (None, [], ())
            if is_typed:
                ctx.obj[parameter.name] = value
        return super().invoke(ctx)


def _params_of(declared: Iterable[tuple[str, Any, Any]]) -> list[Any]:
    """Return typer's parameters for some options, each given by name, type and ``typer.Option``.

    Typer makes parameters only of the signature of a function. So an empty function gets a
    signature with these options, becomes a command, and the parameters of that are returned.
    """

    def command() -> None: ...

    keyword = inspect.Parameter.KEYWORD_ONLY
    parameters: list[inspect.Parameter] = []
    for name, kind, option in declared:
        parameters.append(
            inspect.Parameter(
                name, keyword, default=None, annotation=Annotated[kind | None, option]
            )
        )
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    holder = typer.Typer(add_completion=False)
    holder.command()(command)
    return typer.main.get_command(holder).params


class RunCommand(DeclaredCommand):
    """The command that plays a plan; plans are imported for its own help only."""

    def declared(self) -> Iterator[tuple[str, Any, Any]]:
        """Yield name, type and option of the plan's options that ``roboirg run`` has, by panel.

        The help of each ends with its default.
        """
        from roboirg.runs.plan.plan_fields import plan_options

        options = {option.name: option for option in plan_options()}
        for panel, names in _PANELS.items():
            for name in names:
                text = options[name].help
                if options[name].default is not None:
                    text += f"  ({options[name].default})"
                if name == "policies":  # typed once for each policy
                    flag = typer.Option("--policy", help=text, rich_help_panel=panel)
                    yield name, list[str], flag
                else:
                    yield name, str, typer.Option(help=text, rich_help_panel=panel)


class WordsCommand(DeclaredCommand):
    """A command with the options of one instruction; it chooses settings and forms itself."""

    def declared(self) -> Iterator[tuple[str, Any, Any]]:
        """Yield the options of an instruction."""
        for option in fields(InstructionOptions):
            if option.name not in ("setting", "form", "delivery"):
                yield option.name, str, typer.Option(help=option.metadata["help"])

"""Options of commands that are declared elsewhere: fields of a plan, options of instructions."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator
from dataclasses import fields
from functools import partial
from typing import Annotated, Any

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
    WORDS: ("stages", "wordings", "language"),
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
        """Call the function."""
        given = {one.name: ctx.params.pop(one.name) for one in self._made}
        ctx.obj = {name: value for name, value in given.items() if value not in (None, [], ())}
        return super().invoke(ctx)


def _params_of(declared: Iterable[tuple[str, Any, Any]]) -> list[Any]:
    """Return typer's parameters of a command."""

    def command() -> None: ...

    keyword = inspect.Parameter.KEYWORD_ONLY
    parameters = [
        inspect.Parameter(name, keyword, default=None, annotation=Annotated[kind | None, option])
        for name, kind, option in declared
    ]
    # Typer reads both.
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {one.name: one.annotation for one in parameters}
    holder = typer.Typer(add_completion=False)
    holder.command()(command)
    return typer.main.get_command(holder).params


class RunCommand(DeclaredCommand):
    """The command that plays a plan; plans are imported for its own help only."""

    def declared(self) -> Iterator[tuple[str, Any, Any]]:
        """Yield the daily options of a plan; their texts end with the defaults."""
        from roboirg.evaluation.plan.plan import plan_options

        options = {one.name: one for one in plan_options()}
        for panel, names in _PANELS.items():
            for one in map(options.__getitem__, names):
                text = one.help if one.default is None else f"{one.help}  ({one.default})"
                option = partial(typer.Option, help=text, rich_help_panel=panel)
                if one.name == "policies":
                    yield one.name, list[str], option("--policy")
                    continue
                yield one.name, str, option()


class WordsCommand(DeclaredCommand):
    """A command with the options of one instruction; it chooses settings and forms itself."""

    def declared(self) -> Iterator[tuple[str, Any, Any]]:
        """Yield the options of an instruction."""
        for one in fields(InstructionOptions):
            if one.name not in ("setting", "form", "delivery"):
                yield one.name, str, typer.Option(help=one.metadata["help"])

"""Explicit: one command that states every slot."""

from __future__ import annotations

from roboirg.language.kinds import KINDS
from roboirg.language.phrases import Phrase
from roboirg.language.request import Draft, Request, Said, SettingRule


def stated(request: Request) -> dict[str, Phrase]:
    """The fields of the command, every value named outright."""
    return {part.field: KINDS[part.kind].named(request, part) for part in request.parts}


def say(request: Request) -> Draft:
    """The command alone."""
    return Draft((Said("command", request.command(stated(request))),))


SETTING = SettingRule("explicit", say)

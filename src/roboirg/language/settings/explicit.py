"""Explicit: one command that states every slot."""

from __future__ import annotations

from roboirg.language.request import Draft, Request, Said, SettingRule
from roboirg.language.slot_types import Fields, kinds_in


def stated(request: Request) -> Fields:
    """The fields of the command, every value named outright."""
    fields: Fields = {}
    for kind, parts in kinds_in(request):
        fields |= kind.stated(request, parts)
    return fields


def say(request: Request) -> Draft:
    """The command alone."""
    return Draft((Said("command", request.command(stated(request))),))


SETTING = SettingRule("explicit", say)

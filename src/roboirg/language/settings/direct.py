"""Direct: an introduction names every slot value, the command only points back."""

from __future__ import annotations

from roboirg.language.phrases import sentences
from roboirg.language.request import Draft, Request, Said, SettingRule
from roboirg.language.settings.explicit import stated
from roboirg.language.slot_types import Fields, kinds_in


def introduction(request: Request) -> Said:
    """What direct and contextual instructions begin with."""
    said = [kind.introduce(request, parts) for kind, parts in kinds_in(request)]
    return Said("introduction", sentences(said))


def command(request: Request) -> Said:
    """What direct and contextual instructions end with."""
    if request.resolved:
        return Said("command", request.command(stated(request)))
    fields: Fields = {}
    for kind, parts in kinds_in(request):
        fields |= kind.reduced(request, parts)
    return Said("command", request.command(fields))


def say(request: Request) -> Draft:
    """Introduction and command."""
    return Draft((introduction(request), command(request)))


SETTING = SettingRule("direct", say)

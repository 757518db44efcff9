"""Contextual: direct, with reinforcement, distractors and a cue before the command."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from roboirg.language import templates
from roboirg.language.phrases import Phrase, fill, plain, sentences
from roboirg.language.request import (
    DISTRACTORS,
    STAGE_SETS,
    InstructionRequest,
    InstructionSpec,
    UtteranceSpec,
)
from roboirg.language.setting import Setting
from roboirg.language.settings import direct
from roboirg.language.slot_types import slot_types_in

REINFORCE, DISTRACT, ANNOUNCE = 2, 3, 4
"""Numbers of the stages between introduction and command."""


def say(request: InstructionRequest) -> InstructionSpec:
    """The stages that were asked for; 1 and 5 alone are the direct instruction."""
    said = [direct.introduction(request)]
    if REINFORCE in request.stages:
        said.append(reinforcement(request))
    if DISTRACT in request.stages:
        said += [UtteranceSpec("distractor", phrase) for phrase in distractors(request)]
    if ANNOUNCE in request.stages:
        cue = request.chooser.pick("cue", templates.CUES)
        said.append(UtteranceSpec("cue", plain(cue)))
    said.append(direct.command(request))
    notes: dict[str, object] = {"stages": list(request.stages)}
    if DISTRACT in request.stages:
        notes |= {"distractor": request.distractor, "distractors": request.distractors}
    return InstructionSpec(tuple(said), notes)


def reinforcement(request: InstructionRequest) -> UtteranceSpec:
    """A further remark on each referent, in the order of the introduction."""
    remarks: list[Phrase] = []
    for kind, parts in slot_types_in(request):
        template = request.chooser.pick(f"{kind.name} reinforcement", kind.reinforcements)
        pointing = kind.pointing(request, parts)
        remarks.append(fill(template, {"ref": pointing}, plural=kind.plural(parts)))
    return UtteranceSpec("reinforcement", sentences(remarks))


def distractors(request: InstructionRequest) -> tuple[Phrase, ...]:
    """As many remarks as asked for; fewer of them are always the beginning of more."""
    source = _competing(request) if request.distractor == "competing" else _neutral(request)
    return tuple(next(source) for _ in range(request.distractors))


def _neutral(request: InstructionRequest) -> Iterator[Phrase]:
    # One order, gone through again and again: the same remark returns as late as possible.
    remarks = [plain(sentence) for sentence in templates.NEUTRAL_DISTRACTORS]
    return request.chooser.endless("distractor", remarks)


def _competing(request: InstructionRequest) -> Iterator[Phrase]:
    rivals = [
        rival for kind, parts in slot_types_in(request) for rival in kind.rivals(request, parts)
    ]
    return request.chooser.endless("competing distractor", rivals)


SETTING = Setting(
    name="contextual",
    order=3,
    summary="direct, with reinforcement, a distractor and a cue before the command",
    color="#009E73",
    say=say,
    reads=frozenset({"stages", "distractor", "distractors"}),
    variants=tuple(
        {"stages": stages, "distractor": distractor}
        for stages, distractor in itertools.product(STAGE_SETS, DISTRACTORS)
    ),
    example=1,
)

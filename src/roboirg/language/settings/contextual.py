"""The contextual setting: direct, with reinforcement, distractors and a cue before the command."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import NamedTuple

from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.phrases import Phrase, fill, plain
from roboirg.language.request import (
    DISTRACTORS,
    STAGE_SETS,
    InstructionRequest,
    InstructionSpec,
    UtteranceSpec,
)
from roboirg.language.settings import direct
from roboirg.language.settings.setting import Instruct, Setting
from roboirg.language.slot_types import slot_types_in
from roboirg.language.templates import remarks

REINFORCEMENT, DISTRACTOR, CUE = 2, 3, 4
"""Numbers of the stages between introduction and command."""

MANY_DISTRACTORS = 4
"""Length of the context that must begin with the distractors of the default one."""


def say(request: InstructionRequest) -> InstructionSpec:
    """Return the requested stages; 1 and 5 alone are the direct instruction."""
    stages, distractor = request.options.stages, request.options.distractor
    utterances = [direct.introduction(request)]
    if REINFORCEMENT in stages:
        utterances.append(_reinforcement(request))
    distracting = _distractors(request, distractor) if DISTRACTOR in stages else ()
    utterances += [UtteranceSpec("distractor", phrase) for phrase, _ in distracting]
    if CUE in stages:
        utterances.append(UtteranceSpec("cue", plain(request.pick("cue", remarks.CUES))))
    utterances.append(direct.command(request))
    notes: dict[str, object] = {"stages": list(stages)}
    if distracting:
        says_it = _says_it(utterances[-1])
        notes |= {"distractor": distractor, "distractors": request.options.distractors}
        notes["recency_rival"] = distracting[-1].thing if says_it else None
    return InstructionSpec(tuple(utterances), notes)


def _reinforcement(request: InstructionRequest) -> UtteranceSpec:
    """Return one more remark on the last one of the referents."""
    *_, (slot_type, goal_values) = slot_types_in(request)
    template = request.pick(f"{slot_type.name} reinforcement", slot_type.reinforcements)
    pointing = slot_type.pointing(request, goal_values)
    remark = fill(template, {"ref": pointing}, plural=slot_type.plural(request, goal_values))
    return UtteranceSpec("reinforcement", remark)


class _Distractor(NamedTuple):
    phrase: Phrase
    thing: str | None


def _distractors(request: InstructionRequest, kind: str) -> tuple[_Distractor, ...]:
    """Return the requested number of remarks; a longer list begins with every shorter one."""
    source = _competing(request) if kind == "competing" else _neutral(request)
    return tuple(itertools.islice(source, request.options.distractors))


def _says_it(command: UtteranceSpec) -> bool:
    """Return whether a command says *it*, which could mean the one thing in a remark before."""
    return any(piece.tag is not None and piece.tag.expression == "it" for piece in command.phrase)


def _neutral(request: InstructionRequest) -> Iterator[_Distractor]:
    known = remarks.NEUTRAL_DISTRACTORS.of(request.pool)
    # The order stays the same in each cycle, so that repetitions are as far apart as possible.
    for remark in request.sampler.cycle("distractor", known):
        yield _Distractor(plain(remark.text), remark.thing)


def _competing(request: InstructionRequest) -> Iterator[_Distractor]:
    competing = [
        _Distractor(remark, None)
        for slot_type, goal_values in slot_types_in(request)
        for remark in slot_type.competing(request, goal_values)
    ]
    return request.sampler.cycle("competing distractor", competing)


def _pairing_rules(instruct: Instruct) -> Iterator[str]:
    direct_one = instruct(InstructionOptions("direct"))
    contextual = instruct(InstructionOptions("contextual"))
    if instruct(InstructionOptions("contextual", stages=(1, 5))).turns != direct_one.turns:
        yield "stages 1 and 5 are not the direct instruction"
    if (contextual.turns[0], contextual.command) != (direct_one.turns[0], direct_one.command):
        yield "introduction or command are not those of direct"
    long = instruct(InstructionOptions("contextual", distractors=MANY_DISTRACTORS))
    if (long.turns[:3], long.turns[-2:]) != (contextual.turns[:3], contextual.turns[-2:]):
        yield "few distractors are not the beginning of many"


SETTING = Setting(
    name="contextual",
    order=3,
    summary="direct, with reinforcement, a distractor and a cue before the command",
    color="#009E73",
    say=say,
    reads=frozenset({"stages", "distractor", "distractors", "delivery", "language"}),
    variants=tuple(
        {"stages": stages, "distractor": distractor}
        for stages, distractor in itertools.product(STAGE_SETS, DISTRACTORS)
    ),
    pairing_rules=_pairing_rules,
    example=1,
    offers="contextual",
)

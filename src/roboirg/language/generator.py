"""From an episode to an instruction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.language.instruction import FORMS, Instruction, Mention, Utterance
from roboirg.language.landmarks import FRAMES
from roboirg.language.phrases import speak
from roboirg.language.request import DISTRACTORS, STAGE_SETS, InstructionRequest, InstructionSpec
from roboirg.language.settings import all_settings, get_setting, settings_of
from roboirg.language.template_sampler import TemplateSampler
from roboirg.language.templates import LANGUAGE_VERSION
from roboirg.tasks import get_task

Name = TypeVar("Name", bound=str)

_UNSAID: dict[str, object] = {
    "pattern": None,
    "patterns": [],
    "relation": None,
    "reference": None,
    "stages": [],
    "distractor": None,
    "distractors": 0,
    "landmarks": [],
    "landmark_classes": [],
    "frame": None,
}
"""The metadata of an instruction to which a key does not apply."""


def instruct(
    episode: Episode,
    setting: str = "explicit",
    form: str = "implicit",
    *,
    stages: Sequence[int] = (1, 2, 3, 4, 5),
    distractor: str = "neutral",
    distractors: int = 1,
    frame: str = "robot",
) -> Instruction:
    """The instruction of an episode: the same arguments give the same bytes, always.

    Args:
        episode: what is to be said.
        setting: ``explicit``, ``direct``, ``reasoning``, ``contextual`` or ``spatial``.
        form: ``implicit``, or ``resolved`` with the command's referring expressions replaced by
            what they stand for. An explicit instruction is its own resolved form.
        stages: of the contextual setting: 1 introduction, 2 reinforcement, 3 distractor, 4 cue,
            5 command. Other settings do not read it, nor the next two.
        distractor: ``neutral`` remarks, or ``competing`` ones that name other values.
        distractors: how many of them.
        frame: whose left and right the spatial setting means, ``robot`` or ``camera``.

    Raises:
        UnknownNameError: a name does not exist.
        InvalidValueError: the setting is not defined for the task, the stages are none of the
            four sets, there are no distractors, or no landmark tells the place.
    """
    rule = get_setting(setting, get_task(episode.task))
    request = _request(episode, form, stages, distractor, distractors, frame)
    refused = rule.refusal(request)
    if refused is not None:
        raise InvalidValueError(
            f"The {setting} setting cannot express episode {episode.key} (seed {episode.seed}): "
            f"{refused}."
        )
    return _instruction(request, rule.name, rule.say(request))


def expressible(episode: Episode, *, frame: str = "robot") -> tuple[str, ...]:
    """The settings in which this episode can be told; all of its task's, or all but spatial.

    Args:
        episode: what is to be said.
        frame: whose left and right the spatial setting would mean, ``robot`` or ``camera``.
    """
    request = _request(episode, "implicit", STAGE_SETS[-1], "neutral", 1, frame)
    return tuple(
        name
        for name in settings_of(get_task(episode.task))
        if all_settings()[name].refusal(request) is None
    )


def can_express(
    episode: Episode,
    setting: str,
    *,
    stages: Sequence[int] = (1, 2, 3, 4, 5),
    distractor: str = "neutral",
    distractors: int = 1,
    frame: str = "robot",
) -> bool:
    """Whether an episode can be told in a setting of its task, with the options of `instruct`."""
    request = _request(episode, "implicit", stages, distractor, distractors, frame)
    return get_setting(setting, get_task(episode.task)).refusal(request) is None


def refusals(episode: Episode) -> dict[str, str]:
    """Return why settings of the episode's task cannot express it, by name of the setting."""
    request = _request(episode, "implicit", STAGE_SETS[-1], "neutral", 1, "robot")
    found = {
        name: all_settings()[name].refusal(request) for name in settings_of(get_task(episode.task))
    }
    return {name: reason for name, reason in found.items() if reason is not None}


def _request(
    episode: Episode,
    form: str,
    stages: Sequence[int],
    distractor: str,
    distractors: int,
    frame: str,
) -> InstructionRequest:
    if tuple(stages) not in STAGE_SETS:
        sets = ", ".join(str(one) for one in STAGE_SETS)
        raise InvalidValueError(f"The stages {tuple(stages)} are none of the four sets: {sets}.")
    if isinstance(distractors, bool) or not isinstance(distractors, int) or distractors < 1:
        raise InvalidValueError(f"distractors is {distractors!r}; it must be a number from 1 on.")
    task = get_task(episode.task)
    return InstructionRequest(
        episode=episode,
        task=task,
        form=_one_of("form", form, FORMS),
        stages=tuple(stages),
        distractor=_one_of("distractor", distractor, DISTRACTORS),
        distractors=distractors,
        frame=_one_of("frame", frame, FRAMES),
        chooser=TemplateSampler(f"{LANGUAGE_VERSION}|{task.name}|{episode.seed}"),
    )


def _instruction(request: InstructionRequest, setting: str, draft: InstructionSpec) -> Instruction:
    utterances, mentions = _spoken(draft)
    return Instruction(
        task=request.task.name,
        episode=request.episode.key,
        setting=setting,
        form=request.form,
        utterances=utterances,
        mentions=mentions,
        metadata={
            **_UNSAID,
            **draft.notes,
            "language_version": LANGUAGE_VERSION,
            "templates": list(request.chooser.log),
        },
    )


def _one_of(kind: str, name: str, known: Sequence[Name]) -> Name:
    for one in known:
        if name == one:
            return one
    raise UnknownNameError(kind, name, known)


def _spoken(draft: InstructionSpec) -> tuple[tuple[Utterance, ...], tuple[Mention, ...]]:
    utterances: list[Utterance] = []
    mentions: list[Mention] = []
    for index, (stage, phrase) in enumerate(draft.said):
        utterance, found = speak(index, stage, phrase)
        utterances.append(utterance)
        mentions += found
    return tuple(utterances), tuple(mentions)

"""The options that select one instruction of an episode."""

from __future__ import annotations

from typing import NamedTuple

ALL_STAGES = (1, 2, 3, 4, 5)
DEFAULT_DISTRACTOR = "neutral"
DEFAULT_DISTRACTORS = 1
DEFAULT_FRAME = "robot"
DEFAULT_DELIVERY = "prompt"


class InstructionOptions(NamedTuple):
    """The options of an instruction. Equal options give the same words for the same episode.

    All but `delivery` select the words.

    Attributes:
        setting: name of the setting, for example ``"direct"``.
        form: ``implicit``, or ``resolved`` with the command's referring expressions replaced by
            their meaning.
        stages: of the contextual setting: 1 introduction, 2 reinforcement, 3 distractor, 4 cue,
            5 command.
        distractor: of the contextual setting: ``neutral`` or ``competing``.
        distractors: of the contextual setting: their number.
        frame: of the spatial setting: the frame of left and right, ``robot`` or ``camera``.
        wordings: ``train`` or ``test`` for the words of that pool (`roboirg.core.word_pools`); or
            the identity of the wording file whose commands are used, such as
            ``robomme@1a2b3c4d``, which the process must have opened. None for our words of the
            episode's split.
        delivery: ``prompt``, all utterances at once, or ``turns``, one after another
            (`roboirg.core.delivery`).
    """

    setting: str = "explicit"
    form: str = "implicit"
    stages: tuple[int, ...] = ALL_STAGES
    distractor: str = DEFAULT_DISTRACTOR
    distractors: int = DEFAULT_DISTRACTORS
    frame: str = DEFAULT_FRAME
    wordings: str | None = None
    delivery: str = DEFAULT_DELIVERY

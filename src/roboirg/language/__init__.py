"""Instructions: what an episode sounds like in each setting."""

from __future__ import annotations

from roboirg.language.generator import expressible, find_refusals, instruct, instruct_with
from roboirg.language.instruction import FORMS, Instruction, Mention, Utterance
from roboirg.language.mirrored_landmarks import mirrored_objects
from roboirg.language.request import STAGE_SETS
from roboirg.language.scenarios.wording_store import open_wordings
from roboirg.language.settings import plain_settings, setting_names, settings_of
from roboirg.language.word_sampler import LANGUAGE_VERSION

__all__ = [
    "FORMS",
    "LANGUAGE_VERSION",
    "STAGE_SETS",
    "Instruction",
    "Mention",
    "Utterance",
    "expressible",
    "find_refusals",
    "instruct",
    "instruct_with",
    "mirrored_objects",
    "open_wordings",
    "plain_settings",
    "setting_names",
    "settings_of",
]

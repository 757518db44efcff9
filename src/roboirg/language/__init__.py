"""The words: an episode and a setting give an instruction; the resolver reads it back."""

from __future__ import annotations

from roboirg.language.generator import expressible, instruct
from roboirg.language.instruction import FORMS, Instruction, Mention, Utterance
from roboirg.language.interpreter import Interpretation, interpret
from roboirg.language.request import STAGE_SETS
from roboirg.language.settings import setting_names, settings_of
from roboirg.language.templates import LANGUAGE_VERSION

__all__ = [
    "FORMS",
    "LANGUAGE_VERSION",
    "STAGE_SETS",
    "Instruction",
    "Interpretation",
    "Mention",
    "Utterance",
    "expressible",
    "instruct",
    "interpret",
    "setting_names",
    "settings_of",
]

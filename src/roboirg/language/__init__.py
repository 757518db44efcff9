"""The words: an episode and a setting give an instruction; the resolver reads it back."""

from __future__ import annotations

from roboirg.language.generator import STAGE_SETS, expressible, instruct
from roboirg.language.instruction import FORMS, SETTINGS, Instruction, Mention, Utterance
from roboirg.language.interpreter import Interpretation, interpret
from roboirg.language.templates import LANGUAGE_VERSION

__all__ = [
    "FORMS",
    "LANGUAGE_VERSION",
    "SETTINGS",
    "STAGE_SETS",
    "Instruction",
    "Interpretation",
    "Mention",
    "Utterance",
    "expressible",
    "instruct",
    "interpret",
]

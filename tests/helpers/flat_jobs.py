"""Jobs whose options of instructions are given among the other fields."""

from __future__ import annotations

from roboirg.core.instruction_options import InstructionOptions, split_options
from roboirg.evaluation.records.record import Job


def job_of(**fields: object) -> Job:
    words, others = split_options(fields)
    return Job(**others, options=InstructionOptions(**words))

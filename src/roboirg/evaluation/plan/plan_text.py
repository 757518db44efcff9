"""Write a plan as a file in which every field is explained."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

import msgspec
import yaml

from roboirg.core.instruction_options import OPTION_HELP
from roboirg.evaluation.plan.plan import SINGLE_OPTIONS, Plan

_WIDTH = 100
_END = "...\n"
"""What YAML writes after a text that stands alone."""


def plan_text(plan: Plan) -> str:
    """Return a plan as YAML that `read_plan_file` reads; the comments explain each field."""
    return "\n".join(
        f"{_comment(explanation)}\n{_line(name, value)}"
        for name, value, explanation in _fields(plan)
    )


def _fields(plan: Plan) -> Iterator[tuple[str, object, str]]:
    """Yield name, value and explanation of each key of a plan file."""
    for name, field in Plan.model_fields.items():
        if name == "options":
            for option in SINGLE_OPTIONS:
                yield option, getattr(plan.options, option), OPTION_HELP[option]
        elif name == "episodes":
            yield name, _ranges(plan.episodes), str(field.description)
        else:
            yield name, getattr(plan, name), str(field.description)


def _comment(text: str) -> str:
    return textwrap.fill(text, _WIDTH, initial_indent="# ", subsequent_indent="# ")


def _line(name: str, value: object) -> str:
    """Return a key with its value; lists stand in brackets."""
    if value is None:
        return f"{name}:\n"
    text = yaml.safe_dump(
        msgspec.to_builtins(value), default_flow_style=True, width=_WIDTH, allow_unicode=True
    )
    return f"{name}: {text.removesuffix(_END)}"


def _ranges(numbers: Sequence[int]) -> str:
    """Return numbers as typed: 0-3,7 for 0, 1, 2, 3 and 7."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    texts = [str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs]
    # One number without a comma would mean the first episodes.
    return f"{texts[0]}," if len(numbers) == 1 else ",".join(texts)

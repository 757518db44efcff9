"""Read plans from YAML files, from the folders of runs (plan.json) and from the package."""

from __future__ import annotations

import importlib.resources
import inspect
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import msgspec
import yaml

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.instruction_options import OPTION_HELP
from roboirg.evaluation.plan.plan import SINGLE_OPTIONS, Plan
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.plan.stored_plans import present_fields
from roboirg.util.regular_file import read_regular

_PACKAGE = "roboirg.evaluation.plan"
_FOLDER = "plans"
_MOST_BYTES = 4_000_000
"""Of a plan file; lists of 10,000 numbers, the longest that are played, have less than 0.2 MB."""
_SUFFIXES = (".yaml", ".yml", ".json")
"""JSON is YAML, too: a run's plan.json can be played again."""
_LISTS = frozenset(inspect.signature(make_plan).parameters) - {"options"}
"""Keys whose values are lists on the command line."""
_WIDTH = 100
_END = "...\n"
"""What YAML writes after a text that stands alone."""


def named_plans() -> tuple[str, ...]:
    """Return the names of the plans that come with the package."""
    names = (Path(file.name) for file in _folder().iterdir())
    return tuple(sorted(name.stem for name in names if name.suffix in _SUFFIXES))


def read_plan_file(name: str, section: str = "") -> dict[str, Any]:
    """Read a plan file as options of `make_plan`.

    Lists become text as typed on the command line: ``[1, 5]`` becomes ``"1,5"``, and
    ``[[1, 5], [1, 2, 5]]`` becomes ``"1,5;1,2,5"``.

    Args:
        name: name of a plan that comes with the package, or path of a YAML file, or of the
            plan.json that a run wrote.
        section: key of what a command other than `run` reads, if it has one.

    Raises:
        UnknownNameError: there is no such plan, or it has an unknown key.
        InvalidValueError: the file cannot be read, is not a mapping or has a key twice.
    """
    data = _load(name)
    if not isinstance(data, Mapping):
        raise InvalidValueError(
            f"The plan {name!r} is of type {type(data).__name__}; it must be a mapping such as "
            "'tasks: all'."
        )
    known = (*Plan.model_fields, *SINGLE_OPTIONS, *([section] if section else []))
    for key in data:
        if key not in known:
            raise UnknownNameError(f"plan key (in {name!r})", key, known)
    return {key: _as_typed(key, value) for key, value in data.items() if value is not None}


class _PlanLoader(yaml.SafeLoader):
    """Refuses a mapping with a key twice, of which YAML would take the last, and aliases.

    A few lines of aliases of aliases stand for billions of values.
    """

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            line = self.peek_event().start_mark.line + 1  # type: ignore[no-untyped-call]
            raise yaml.YAMLError(f"line {line} has an alias, which a plan cannot have")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for number, key in enumerate(keys):
            if key in keys[:number]:
                line = node.value[number][0].start_mark.line + 1
                raise yaml.YAMLError(f"line {line} has the key {key!r} again")
        return super().construct_mapping(node, deep=deep)


def _load(name: str) -> object:
    file = _find(name)
    try:
        # A safe loader, with two more checks.
        data = yaml.load(_text(file), _PlanLoader)  # noqa: S506
    except (OSError, UnicodeDecodeError, InvalidValueError) as error:
        words = str(error).rstrip(".")
        raise InvalidValueError(f"The plan {name!r} cannot be read: {words}.") from error
    except RecursionError as error:
        raise InvalidValueError(f"The plan {name!r} is nested too deeply.") from error
    except (yaml.YAMLError, ValueError) as error:  # such as a number of too many digits
        words = " ".join(str(error).split())
        raise InvalidValueError(f"The plan {name!r} is not valid YAML: {words}.") from error
    is_stored = name.endswith(".json") and isinstance(data, dict)
    return present_fields(data) if is_stored else data


def _text(file: Path | Traversable) -> str:
    if isinstance(file, Path):
        return read_regular(file, _MOST_BYTES).decode()
    return file.read_text(encoding="utf-8")


def _find(name: str) -> Path | Traversable:
    path = Path(name)
    if path.suffix in _SUFFIXES:
        return path
    if name not in named_plans():
        raise UnknownNameError("plan", name, [*named_plans(), "FILE.yaml"])
    return _folder() / f"{name}.yaml"


def _folder() -> Traversable:
    return importlib.resources.files(_PACKAGE) / _FOLDER


def _as_typed(key: str, value: object) -> object:
    if value is False:
        return "off"  # YAML 1.1 reads the word as false
    if key not in _LISTS:
        return value
    if not isinstance(value, list):
        return [str(value)] if key == "policies" else str(value)
    if key == "policies":
        return [_named(one) for one in value]
    if key == "stages" and any(isinstance(one, list) for one in value):
        return ";".join(str(_as_typed(key, one)) for one in value)
    typed = ",".join(map(str, value)) or ("none" if key == "retry_on" else "")
    # A single number without a comma would mean the first n episodes.
    return f"{typed}," if key == "episodes" and len(value) == 1 else typed


def _named(policy: object) -> str:
    """Return a policy as typed; what a run's plan.json knew of it may have changed."""
    if isinstance(policy, Mapping):
        return f"{policy.get('name')}={policy.get('spec')}"
    return str(policy)


def plan_text(plan: Plan) -> str:
    """Return a plan as YAML that `read_plan_file` reads; the comments explain each field."""
    comments = textwrap.TextWrapper(_WIDTH, initial_indent="# ", subsequent_indent="# ")
    return "\n".join(
        f"{comments.fill(explanation)}\n{_line(name, value)}"
        for name, value, explanation in _fields(plan)
    )


def _fields(plan: Plan) -> Iterator[tuple[str, object, str]]:
    """Yield name, value and explanation of each key of a plan file."""
    for name, field in Plan.model_fields.items():
        if name == "options":
            for option in SINGLE_OPTIONS:
                yield option, getattr(plan.options, option), OPTION_HELP[option]
        elif name == "policies":
            yield name, [one.text for one in plan.policies], str(field.description)
        elif name == "episodes":
            yield name, _ranges(plan.episodes), str(field.description)
        else:
            yield name, getattr(plan, name), str(field.description)


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

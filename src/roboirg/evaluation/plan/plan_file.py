"""Read plans from YAML files, from the folders of runs (plan.json) and from the package."""

from __future__ import annotations

import itertools
import re
import textwrap
from collections.abc import Mapping, Sequence
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import msgspec
import yaml

from roboirg.core.errors import InvalidValueError, check_names
from roboirg.evaluation.plan.plan import PLAN_KEYS, Plan, plan_options
from roboirg.util.discovery import entry_names, entry_points_of, load_entry
from roboirg.util.regular_file import read_regular

_PACKAGE = "roboirg.evaluation.plan"
_FOLDER = "plans"
GROUP = "roboirg.plans"
"""Entry points of other packages: NAME = "package" with the file NAME.yaml."""
_MOST_BYTES = 4_000_000
"""Of a plan file; lists of 10,000 numbers, the longest that are played, have less than 0.2 MB."""
_SUFFIXES = (".yaml", ".yml", ".json")
"""JSON is YAML, too: a run's plan.json can be played again."""
_WIDTH = 100
_TEXT = "tag:yaml.org,2002:str"
_PLAIN_NUMBER = re.compile(r"[-+]?(0|[1-9]\d*)?(\.\d*)?([eE][-+]?\d+)?")


def named_plans() -> tuple[str, ...]:
    """Return the names of the plans that come with this package and with others."""
    files = (Path(file.name) for file in _folder().iterdir())
    return tuple(
        sorted({*(one.stem for one in files if one.suffix in _SUFFIXES), *entry_names(GROUP)})
    )


def read_plan_file(name: str, section: str = "") -> dict[str, Any]:
    """Read a plan file as options of `make_plan`.

    Args:
        name: name of a plan that comes with the package, or path of a YAML file, or of the
            plan.json that a run wrote.
        section: key of what a command other than `run` reads, if it has one.

    Raises:
        UnknownNameError: there is no such plan, or it has an unknown key.
        InvalidValueError: the file cannot be read, is not a mapping, has a key twice or without a
            value, or has what YAML reads as something else than it looks.
    """
    data = _load(name)
    if not isinstance(data, Mapping):
        raise InvalidValueError(
            f"The plan {name!r} is of type {type(data).__name__}; it must be a mapping such as "
            "'tasks: all'."
        )
    check_names(f"plan key (in {name!r})", data, filter(None, (*PLAN_KEYS, section)))
    found = dict(data)
    policies = found.get("policies")
    if isinstance(policies, list):
        found["policies"] = [_named(one) for one in policies]
    return found


def _named(policy: object) -> str:
    """Return a policy as typed; what a run's plan.json knew of it may have changed."""
    if not isinstance(policy, Mapping):
        return str(policy)
    if "spec" not in policy:
        raise InvalidValueError(f"The plan has {policy!r} as a policy; write NAME=SPEC.")
    return f"{policy.get('name')}={policy['spec']}"


class _PlanLoader(yaml.SafeLoader):
    """Reads what stands there, and refuses what YAML 1.1 takes to be something else.

    That is ``010`` (8 to YAML), ``1:30`` (90), ``1_000``, dates and nothing (null); ``yes`` and
    ``off`` stay texts. It also refuses a mapping with a key twice, of which YAML would take the
    last, and aliases: a few lines of aliases of aliases stand for billions of values.
    """

    def compose_scalar_node(self, anchor: dict[str, yaml.Node]) -> yaml.ScalarNode:
        node = super().compose_scalar_node(anchor)
        text = node.value
        kind = node.tag.rpartition(":")[2]
        if kind == "bool":
            node.tag = _TEXT
        is_odd = kind in ("int", "float", "timestamp") and not _PLAIN_NUMBER.fullmatch(text)
        is_empty = kind == "null" and not text
        if is_odd or is_empty:
            line = node.start_mark.line + 1
            raise InvalidValueError(
                f"line {line} has {text[:40] or 'no value'}; write a plain number such as 10 or "
                "0.5, or a text in quotes, or leave the key out"
            )
        return node

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
        # A safe loader, with more checks.
        return yaml.load(_text(file), _PlanLoader)  # noqa: S506
    except (OSError, UnicodeDecodeError, InvalidValueError) as error:
        raise InvalidValueError(
            f"The plan {name!r} cannot be read: {str(error).rstrip('.')}."
        ) from error
    except RecursionError as error:
        raise InvalidValueError(f"The plan {name!r} is nested too deeply.") from error
    except (yaml.YAMLError, ValueError) as error:  # such as a number of too many digits
        raise InvalidValueError(
            f"The plan {name!r} is not valid YAML: {' '.join(str(error).split())}."
        ) from error


def _text(file: Path | Traversable) -> str:
    if isinstance(file, Path):
        return read_regular(file, _MOST_BYTES).decode()
    return file.read_text(encoding="utf-8")


def _find(name: str) -> Path | Traversable:
    path = Path(name)
    if path.suffix in _SUFFIXES:
        return path
    check_names("plan", [name], [*named_plans(), "FILE.yaml"])
    others = [
        resources.files(load_entry(one)) for one in entry_points_of(GROUP) if one.name == name
    ]
    return (others or [_folder()])[0] / f"{name}.yaml"


def _folder() -> Traversable:
    return resources.files(_PACKAGE) / _FOLDER


def plan_text(plan: Plan) -> str:
    """Return a plan as YAML that `read_plan_file` reads; the comments explain each option."""
    comments = textwrap.TextWrapper(_WIDTH, initial_indent="# ", subsequent_indent="# ")
    shown = {
        "policies": [one.text for one in plan.policies],
        "episodes": _ranges(plan.episodes),
        "wordings": plan.wordings and plan.wordings.file,
    }
    return "\n".join(
        f"{comments.fill(one.help)}\n{one.name}: {_yaml(shown.get(one.name, one.value_in(plan)))}"
        for one in plan_options()
    )


def _yaml(value: object) -> str:
    """Return a value; lists stand in brackets."""
    text = yaml.safe_dump(
        msgspec.to_builtins(value), default_flow_style=True, width=_WIDTH, allow_unicode=True
    )
    return text.removesuffix("...\n")  # which YAML writes after a text that stands alone


def _ranges(numbers: Sequence[int]) -> str:
    """Return numbers as typed: 0-3,7 for 0, 1, 2, 3 and 7."""
    runs = itertools.groupby(enumerate(numbers), lambda one: one[1] - one[0])
    ends = [(run[0][1], run[-1][1]) for run in (list(found) for _, found in runs)]
    text = ",".join(str(one) if one == last else f"{one}-{last}" for one, last in ends)
    # One number without a comma would mean the first episodes.
    return f"{text}," if len(numbers) == 1 else text

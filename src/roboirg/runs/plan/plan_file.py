"""Read plans from YAML files, from the folders of runs (plan.json) and from the package."""

from __future__ import annotations

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
from roboirg.runs.plan.plan import Plan
from roboirg.runs.plan.plan_fields import PLAN_KEYS, plan_options
from roboirg.util.discovery import entry_names, entry_points_of, load_entry
from roboirg.util.regular_file import read_regular

_PACKAGE = "roboirg.runs.plan"
_FOLDER = "plans"
GROUP = "roboirg.plans"
"""Entry points of other packages: NAME = "package" with the file NAME.yaml."""
_MOST_BYTES = 4_000_000
"""Of a plan file; lists of 10,000 numbers, the longest that are played, have less than 0.2 MB."""
_SUFFIXES = (".yaml", ".yml", ".json")
"""JSON is YAML, too: a run's plan.json can be played again."""
_WIDTH = 100
_TEXT = "tag:yaml.org,2002:str"
"""What YAML calls the type of a text."""
_PLAIN_NUMBER = re.compile(r"[-+]?(0|[1-9]\d*)?(\.\d*)?([eE][-+]?\d+)?")
"""Numbers such as 10, -0.5 and 1e-3, without leading zeros or underscores."""


def named_plans() -> tuple[str, ...]:
    """Return the names of the plans that come with this package and with others."""
    names = set(entry_names(GROUP))
    for file in _folder().iterdir():
        path = Path(file.name)
        if path.suffix in _SUFFIXES:
            names.add(path.stem)
    return tuple(sorted(names))


def read_plan_file(name: str, section: str = "") -> dict[str, Any]:
    """Return the options in a plan file, as `make_plan` takes them.

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
    known_keys = [*PLAN_KEYS]
    if section:
        known_keys.append(section)
    check_names(f"plan key (in {name!r})", data, known_keys)

    options = dict(data)
    policies = options.get("policies")
    if isinstance(policies, list):
        options["policies"] = [_policy_as_typed(policy) for policy in policies]
    return options


def _policy_as_typed(policy: object) -> str:
    """Return a policy of a plan as ``NAME=SPEC``.

    The plan.json of a run has a mapping with more, such as the version, which may have changed.
    """
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
        """Return the node of a value that is no list or mapping; raise if YAML reads it oddly.

        ``yes`` stays a text, though YAML takes it for true; ``1_000`` (1000) and ``2024-01-01`` (a
        date) are refused, and so is a key without a value.
        """
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
        """Return the node of any value; raise for an alias (``*name``), which could multiply."""
        if self.check_event(yaml.AliasEvent):
            line = self.peek_event().start_mark.line + 1  # type: ignore[no-untyped-call]
            raise yaml.YAMLError(f"line {line} has an alias, which a plan cannot have")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Make a mapping; raise if it has a key twice, of which YAML would keep only the last."""
        earlier: list[object] = []  # no set: a key may be a list, which the parent class refuses
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if key in earlier:
                line = key_node.start_mark.line + 1
                raise yaml.YAMLError(f"line {line} has the key {key!r} again")
            earlier.append(key)
        return super().construct_mapping(node, deep=deep)


def _load(name: str) -> object:
    """Return what a plan file holds, usually a mapping.

    Raises:
        InvalidValueError: it cannot be read or is not valid YAML; the message is one sentence.
    """
    file = _find(name)
    try:
        # A safe loader, with more checks.
        return yaml.load(_text(file), _PlanLoader)  # noqa: S506
    except (OSError, UnicodeDecodeError, InvalidValueError) as error:
        complaint = str(error).rstrip(".")
        raise InvalidValueError(f"The plan {name!r} cannot be read: {complaint}.") from error
    except RecursionError as error:
        raise InvalidValueError(f"The plan {name!r} is nested too deeply.") from error
    except (yaml.YAMLError, ValueError) as error:  # such as a number of too many digits
        complaint = " ".join(str(error).split())
        raise InvalidValueError(f"The plan {name!r} is not valid YAML: {complaint}.") from error


def _text(file: Path | Traversable) -> str:
    """Return the text of a plan file; one that the user names may not be too large."""
    if isinstance(file, Path):
        return read_regular(file, _MOST_BYTES).decode()
    return file.read_text(encoding="utf-8")


def _find(name: str) -> Path | Traversable:
    """Return the file of a plan: a path, or by name one of this package or of another."""
    path = Path(name)
    if path.suffix in _SUFFIXES:
        return path
    check_names("plan", [name], [*named_plans(), "FILE.yaml"])
    folder = _folder()
    for entry in entry_points_of(GROUP):
        if entry.name == name:
            folder = resources.files(load_entry(entry))
            break
    return folder / f"{name}.yaml"


def _folder() -> Traversable:
    return resources.files(_PACKAGE) / _FOLDER


def plan_text(plan: Plan) -> str:
    """Return a plan as YAML, with a comment on each option; `read_plan_file` reads it."""
    comments = textwrap.TextWrapper(_WIDTH, initial_indent="# ", subsequent_indent="# ")
    as_typed = {
        "policies": [policy.text for policy in plan.policies],
        "episodes": _ranges(plan.episodes),
        "wordings": plan.wordings and plan.wordings.file,
    }
    # Each option stands below its help, in the form in which it is typed.
    texts = []
    for option in plan_options():
        value = as_typed.get(option.name, option.value_in(plan))
        texts.append(f"{comments.fill(option.help)}\n{option.name}: {_yaml(value)}")
    return "\n".join(texts)


def _yaml(value: object) -> str:
    """Return a value as YAML with a line break at its end; lists stand in brackets."""
    plain = msgspec.to_builtins(value)
    text = yaml.safe_dump(plain, default_flow_style=True, width=_WIDTH, allow_unicode=True)
    return text.removesuffix("...\n")  # which YAML writes after a text that stands alone


def _ranges(numbers: Sequence[int]) -> str:
    """Return numbers as typed: ``0-3,7`` for 0, 1, 2, 3 and 7; ``7,`` for 7 alone."""
    if len(numbers) == 1:
        return f"{numbers[0]},"  # without the comma it would mean the first episodes
    texts = []
    first = last = None
    for number in numbers:
        if last is not None and number == last + 1:  # it continues the last range
            texts[-1] = f"{first}-{number}"
        else:
            first = number
            texts.append(str(number))
        last = number
    return ",".join(texts)

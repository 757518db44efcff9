"""Kinds of policies that other packages add: the recipe of docs/add-protocol.md, as it stands."""

import re
import sys
import tomllib
from pathlib import Path

import pytest

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.policies import make_policy
from roboirg.policies.builtin.random_policy import RandomPolicy
from roboirg.policies.by_name import policy_kinds
from roboirg.policies.by_name.finding import read_policy

PAGE = (Path(__file__).parents[2] / "docs" / "add-protocol.md").read_text(encoding="utf-8")


def fenced(language, word):
    blocks = re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)
    return next(block for block in blocks if word in block)


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """Install the recipe as a package of its own, next to an entry point without its module."""
    for cached in (policy_kinds.find_kind, policy_kinds.known_kinds):
        cached.cache_clear()
    (tmp_path / "lab_kind.py").write_text(fenced("python", "PolicyKind("))
    ((group, entries),) = tomllib.loads(fenced("toml", "policy_kinds"))["project"][
        "entry-points"
    ].items()
    info = tmp_path / "lab-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lab\nVersion: 1.0\n")
    lines = [f"{name} = {value}\n" for name, value in entries.items()]
    (info / "entry_points.txt").write_text(f"[{group}]\n{''.join(lines)}gone = no_such_module\n")
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("lab_kind", None)
    for cached in (policy_kinds.find_kind, policy_kinds.known_kinds):
        cached.cache_clear()


@pytest.mark.usefixtures("lab")
def test_the_recipe_makes_policies_in_a_process_of_their_own():
    assert isinstance(make_policy("lab:walk?fast=yes", 3), RandomPolicy)
    assert read_policy("lab:walk").is_foreign
    assert read_policy("lab:walk").is_hosted
    with pytest.raises(UnknownNameError, match="lab:…"):
        make_policy("nothing", 0)


@pytest.mark.usefixtures("lab")
def test_a_kind_is_imported_only_when_it_is_named():
    make_policy("lab:walk", 0)
    with pytest.raises(InvalidValueError, match=r"'gone' .* of lab .* cannot be loaded: Module"):
        make_policy("gone:anything", 0)

"""Kinds of policies that other packages add: the recipe of docs/extend.md, as it stands."""

import sys

import pytest
from doc_recipe import install
from python_process import print_of_python

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.policies import make_policy
from roboirg.policies.builtin.random_policy import RandomPolicy
from roboirg.policies.by_name import policy_kinds
from roboirg.policies.by_name.finding import read_policy


@pytest.fixture
def installed_recipe(tmp_path, monkeypatch):
    """Install the recipe as a package of its own, next to an entry point without its module."""
    for cached in (policy_kinds.find_kind, policy_kinds.known_kinds):
        cached.cache_clear()
    gone = "gone = no_such_module\n"
    install(tmp_path, "extend", "policy_kinds", gone)
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("lab_kind", None)
    for cached in (policy_kinds.find_kind, policy_kinds.known_kinds):
        cached.cache_clear()


@pytest.mark.usefixtures("installed_recipe")
def test_the_documentation_s_new_kind_of_policy_works_in_its_own_process():
    assert isinstance(make_policy("lab:walk?fast=yes", 3), RandomPolicy)
    assert read_policy("lab:walk").is_foreign
    assert read_policy("lab:walk").is_hosted
    with pytest.raises(UnknownNameError, match="lab:…"):
        make_policy("nothing", 0)


@pytest.mark.usefixtures("installed_recipe")
def test_a_broken_kind_of_policy_is_reported_only_when_it_is_named():
    make_policy("lab:walk", 0)
    with pytest.raises(InvalidValueError, match=r"'gone' .* of extend .* cannot be loaded"):
        make_policy("gone:anything", 0)


def test_finding_policies_does_not_load_the_reader_of_commands():
    """Only listeners and rewriters need its patterns, whose compiling delays every command."""
    code = "import sys, roboirg.policies; print('roboirg.reader' in sys.modules)"

    assert print_of_python("-c", code) == "False\n"

"""Every protocol is one file, of this package or of another; the docs list and teach them."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from doc_recipe import install
from python_process import print_of_python
from served_here import served
from wire_episode import INSTRUCTION, moment

from roboirg.apps.policy_check.policy_check import check_policy
from roboirg.policies import make_policy
from roboirg.policies.remote.endpoints import RemoteOptions
from roboirg.policies.remote.protocols import protocols_by_scheme

PAGE = (Path(__file__).parents[2] / "docs" / "servers.md").read_text()


@pytest.fixture
def _fresh_registry():
    """The registry is read again, in the test and after it."""
    protocols_by_scheme.cache_clear()
    yield
    protocols_by_scheme.cache_clear()


@pytest.fixture
def _installed_recipe(tmp_path, monkeypatch, _fresh_registry):
    """The protocol `tiny` of docs/extend.md, installed as a package of its own."""
    install(tmp_path, "extend", "protocols")
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("tiny_protocol", None)


@pytest.mark.usefixtures("_installed_recipe")
def test_a_policy_served_by_the_documentation_s_new_protocol_acts_as_it_does_here():
    """The page's protocol is `tiny`; the random policy draws its actions by its seed, 0."""
    here = make_policy("random", 0)
    here.reset(INSTRUCTION, {})
    with served("random", "tiny") as url:
        client = make_policy(url, 0)
        client.reset(INSTRUCTION, {})
        actions = client.act(moment(0))
        client.close()

    assert np.array_equal(actions, here.act(moment(0)))


@pytest.mark.usefixtures("_installed_recipe")
def test_a_policy_served_by_the_documentation_s_new_protocol_passes_each_check():
    with served("random", "tiny") as url:
        verdicts = {result.verdict for result in check_policy(url)}

    assert verdicts <= {"pass", "note"}


def test_the_documentation_lists_every_protocol():
    """In a table, as in: | `openpi://host:port` | …"""
    listed = re.findall(r"^\| `(.*)://host:port` \|", PAGE, flags=re.MULTILINE)
    assert sorted(listed) == sorted(protocols_by_scheme())


def documented_options(heading):
    """Return the options in the first column of the table below a line of docs/servers.md."""
    table = PAGE.partition(f"\n{heading}")[2].partition("\n| --- |")[2].partition("\n\n")[0]
    first_cells = re.findall(r"^\| (`.*?) \|", table, flags=re.MULTILINE)
    return set(re.findall("`(.*?)`", " ".join(first_cells)))


def test_the_documentation_explains_every_option_of_all_protocols():
    """They are the fields of `RemoteOptions`, and stand in a table of their own."""
    assert documented_options("Options of all protocols") >= set(RemoteOptions.model_fields)


@pytest.mark.parametrize("scheme", protocols_by_scheme())
def test_the_documentation_explains_every_option_of_a_protocol_of_its_own(scheme):
    """Options that not all protocols have stand in a second table."""
    options = set(protocols_by_scheme()[scheme].client.options_type.model_fields)

    assert documented_options("Options of some") >= options - set(RemoteOptions.model_fields)


def without_network_libraries(code):
    """Run Python code in a process without the libraries that policy servers need; return what it
    prints.
    """
    hide = "import sys; sys.modules['websockets'] = sys.modules['msgpack'] = None\n"
    return print_of_python("-c", hide + code)


def test_a_protocol_without_its_network_libraries_is_refused_with_what_to_install():
    """A policy behind each of the four protocols is looked up. The error names what to install,
    `'roboirgbench[remote]'`.
    """
    printed = without_network_libraries(
        """
from roboirg.core.errors import MissingDependencyError
from roboirg.policies import find_policy
for scheme in ("challenge", "mme-vla", "openpi", "vla-eval"):
    try:
        find_policy(f"{scheme}://localhost:1")
    except MissingDependencyError as error:
        print(error)
"""
    )

    assert printed.count("[remote]'") == 4


def test_protocols_are_listed_in_the_help_without_their_network_libraries():
    printed = without_network_libraries(
        "from roboirg.main import main; sys.argv[1:] = ['serve', '--help']; main()"
    )

    assert re.search("challenge.*mme-vla.*openpi", printed)

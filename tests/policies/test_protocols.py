"""Every protocol is one file, of this package or of another; the docs list and teach them."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from doc_recipe import install
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
    """The protocol `tiny` of docs/add-protocol.md, installed as a package of its own."""
    install(tmp_path, "add-protocol", "protocols")
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


def test_the_documentation_explains_every_option_of_each_protocol():
    """Those that all protocols have in a first table, the others in a second one."""
    common = PAGE.split("Options of all protocols")[1].split("Options of some")
    tables = {"common": common[0], "own": common[1].split("**One server")[0]}
    for protocol in protocols_by_scheme().values():
        for option in protocol.client.options_type.model_fields:
            table = tables["common" if option in RemoteOptions.model_fields else "own"]
            assert f"`{option}`" in table, (protocol.name, option)


def test_protocols_are_listed_without_their_network_libraries():
    """To use one is refused, with what to install."""
    program = """
import sys
for name in ("websockets", "msgpack"):
    sys.modules[name] = None  # an import raises ImportError
from roboirg.core.errors import MissingDependencyError
from roboirg.policies import find_policy
from roboirg.policies.remote.protocols import protocols_by_scheme
schemes = list(protocols_by_scheme())
for scheme in schemes:
    try:
        find_policy(f"{scheme}://localhost:1")
    except MissingDependencyError as error:
        assert "[remote]'" in str(error), error
    else:
        raise AssertionError(scheme)
print(*schemes)
sys.argv[1:] = ["serve", "--help"]
from roboirg.main import main
main()
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )

    listed, _, help_text = done.stdout.partition("\n")
    assert listed == "challenge mme-vla openpi vla-eval", done.stderr
    for scheme in listed.split():
        assert scheme in help_text

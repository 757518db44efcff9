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
from roboirg.policies.by_name.policy_classes import url_classes
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
    """The recipe of the docs page, installed as a package of its own."""
    install(tmp_path, "add-protocol", "protocols")
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("tiny_protocol", None)


@pytest.mark.usefixtures("_installed_recipe")
def test_the_documentation_s_new_protocol_serves_a_policy_over_a_socket():
    assert "tiny" in url_classes()
    with served("random", "tiny") as url:
        assert url.startswith("tiny://127.0.0.1:")
        assert {result.verdict for result in check_policy(url)} <= {"pass", "note"}
        client = make_policy(url, 0)
        here = make_policy("random", 0)
        for policy in (client, here):
            policy.reset(INSTRUCTION, {})
        for _ in range(3):
            assert np.array_equal(client.act(moment(0)), here.act(moment(0)))
        client.close()


def test_the_documentation_lists_every_protocol():
    listed = re.findall(r"^\| `(.*)://host:port` \|", PAGE, flags=re.MULTILINE)
    assert sorted(listed) == sorted(protocols_by_scheme())


def test_the_documentation_explains_every_option_of_each_protocol():
    common = PAGE.split("Options of all protocols")[1].split("Options of some")
    tables = {"common": common[0], "own": common[1].split("**One server")[0]}
    for protocol in protocols_by_scheme().values():
        for option in protocol.client.options_type.model_fields:
            table = tables["common" if option in RemoteOptions.model_fields else "own"]
            assert f"`{option}`" in table, (protocol.name, option)


def test_protocols_are_listed_without_their_network_libraries():
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
    assert done.returncode == 0, done.stderr

    listed, help_text = done.stdout.split("\n", 1)
    assert listed.split() == list(protocols_by_scheme())
    for scheme in protocols_by_scheme():
        assert scheme in help_text

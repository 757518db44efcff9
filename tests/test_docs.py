"""The documents are true: links lead somewhere, dependencies are explained, README's code runs."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import roboirg
from roboirg.core.actions import check_chunk
from roboirg.policies import Policy

ROOT = Path(__file__).parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])
README = (ROOT / "README.md").read_text()


def python_blocks(text: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text()):
        if "://" not in target:
            assert (page.parent / target).exists(), target


def test_every_dependency_is_explained_once():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"].values()
    wanted = [*project["dependencies"], *(one for extra in extras for one in extra)]
    names = {re.split(r"[\[<>=]", requirement)[0] for requirement in wanted} - {"roboirgbench"}
    table = (ROOT / "docs" / "dependencies.md").read_text()
    explained = re.findall(r"^\| ([\w-]+) \| [`(]", table, flags=re.MULTILINE)
    assert sorted(explained) == sorted(names)


def test_the_version_is_said_once():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["version"] == roboirg.__version__
    assert f"## {roboirg.__version__}" in (ROOT / "CHANGELOG.md").read_text()


def test_readme_s_policy_is_a_policy_in_fifteen_lines():
    block = next(block for block in python_blocks(README) if "class MyPolicy" in block)
    body = [line for line in block.splitlines() if line.strip() and not line.startswith("#")]
    assert len(body) <= 15
    namespace: dict = {}
    exec(block, namespace)  # noqa: S102 - it is our own README
    policy = namespace["MyPolicy"]()
    assert isinstance(policy, Policy)
    policy.reset("Do it.", {"front_rgb": np.zeros((0, 256, 256, 3), np.uint8)})
    actions = policy.act({"joint_positions": np.zeros(7, np.float32)})
    assert check_chunk(actions).shape == (1, 8)


@pytest.mark.sim
def test_readme_s_environment_plays(capsys):
    exec(python_blocks(README)[-1], {})  # noqa: S102 - it is our own README
    assert capsys.readouterr().out.strip().endswith(".")


def test_the_citation_has_the_version():
    assert f"\nversion: {roboirg.__version__}\n" in (ROOT / "CITATION.cff").read_text()

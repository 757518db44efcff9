"""The distributions of `make dist`: the READMEs for an index, and what a source has."""

import re
import subprocess
from pathlib import Path

import pytest
from hatchling.builders.sdist import SdistBuilder

ROOT = Path(__file__).parents[1]
FOLDERS = [".", "packages/learn", "integrations/lerobot_env_roboirg"]
"""Each has the pyproject.toml and the README.md of a distribution."""
RELATIVE_LINK = re.compile(r"\]\((?!https://)|(?:src|href)=")


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_readme_for_an_index_has_no_relative_link(folder):
    """It would lead nowhere on the page of an index."""
    call = f"source scripts/dist; index_readme https://host/name v1 <{folder}/README.md"

    readme = subprocess.check_output(["bash", "-c", call], cwd=ROOT, text=True)

    assert "](https://host/name/blob/v1/docs/" in readme
    assert not RELATIVE_LINK.search(readme)


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_source_distribution_has_no_results_pictures_or_tests(folder):
    """With them it would be larger than an index takes."""
    files = SdistBuilder(str(ROOT / folder)).recurse_included_files()

    folders = {file.distribution_path.partition("/")[0] for file in files}

    assert folders.isdisjoint({"results", "docs", "tests"})
    assert folders & {"src", "roboirg_learn", "lerobot_env_roboirg"}

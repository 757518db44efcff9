"""The distributions of `make dist`: the READMEs for an index, versions, and what a source has."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest
from hatchling.builders.sdist import SdistBuilder

ROOT = Path(__file__).parents[1]
FOLDERS = (".", "packages/learn", "integrations/lerobot_env_roboirg")
"""Each has the pyproject.toml and the README.md of a distribution."""
LINK = re.compile(r"\]\(([^)]+)\)")
REPOSITORY = "https://host/owner/name"


def readme_for_index(folder):
    """Return the README of a distribution, as scripts/dist changes it for tag v1."""
    done = subprocess.run(
        ["bash", "-c", f"source scripts/dist; index_readme {REPOSITORY} v1"],
        cwd=ROOT,
        input=(ROOT / folder / "README.md").read_text(),
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_readme_for_an_index_differs_in_its_links_alone_and_they_lead_to_the_same_files(folder):
    """A relative link or picture would lead nowhere on the page of an index."""
    readme = (ROOT / folder / "README.md").read_text()

    changed = readme_for_index(folder)

    assert LINK.sub("", changed) == LINK.sub("", readme)
    for link, absolute in zip(LINK.findall(readme), LINK.findall(changed), strict=True):
        if "://" in link:
            assert absolute == link
        elif link.startswith("#"):
            assert absolute == REPOSITORY + link
        else:
            kind = "raw" if "/images/" in link else "blob"
            file = (ROOT / folder / link).resolve().relative_to(ROOT)
            assert absolute == f"{REPOSITORY}/{kind}/v1/{file}"


def test_a_readme_for_an_index_has_no_html_whose_links_would_stay_relative():
    for folder in FOLDERS:
        readme = (ROOT / folder / "README.md").read_text()
        assert not re.search(r"(src|href)=", readme), folder


def test_all_distributions_have_the_same_version():
    """The core's is compared with what else names it in tests/test_docs.py."""
    versions = set()
    for folder in FOLDERS:
        project = tomllib.loads((ROOT / folder / "pyproject.toml").read_text())["project"]
        versions.add(project["version"])

    assert len(versions) == 1


@pytest.mark.parametrize(
    ("folder", "wanted"),
    [
        (".", {"src/roboirg", "CHANGELOG.md", "CITATION.cff"}),
        ("packages/learn", {"roboirg_learn"}),
        ("integrations/lerobot_env_roboirg", {"lerobot_env_roboirg"}),
    ],
)
def test_a_source_distribution_has_the_package_and_no_results_pictures_or_tests(folder, wanted):
    """With them it would be larger than an index takes. Listed is what comes in addition to
    pyproject.toml, README and licenses, which hatchling always takes."""
    files = SdistBuilder(str(ROOT / folder)).recurse_included_files()

    names = {file.distribution_path for file in files}

    for name in names:
        assert any(name == part or name.startswith(f"{part}/") for part in wanted), name

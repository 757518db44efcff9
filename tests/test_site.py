"""The documentation site: built without a warning, no dead link, usable offline."""

import os
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import count_commands
import pytest

import roboirg

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def folder_of_the_site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder],
        cwd=ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1", "JUPYTER_PLATFORM_DIRS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr, done.stderr
    return folder


class Links(HTMLParser):
    """Collects a page's links, its loaded files, and the names that links may point to."""

    def __init__(self, text):
        super().__init__()
        self.links, self.loaded, self.names = [], [], set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.names |= {found.get("id"), found.get("name")} - {None}
        if tag == "a" and found.get("href"):
            self.links.append(found["href"])
        if tag in ("img", "script", "iframe") and found.get("src"):
            self.loaded.append(found["src"])
        if tag == "link" and found.get("rel") in ("stylesheet", "icon"):
            self.loaded.append(found["href"])


@pytest.fixture(scope="module")
def links_of_pages(folder_of_the_site):
    found = {page: Links(page.read_text()) for page in folder_of_the_site.rglob("*.html")}
    return {page: links for page, links in found.items() if page.name != "404.html"}


def test_every_page_of_the_docs_is_on_the_site(folder_of_the_site, links_of_pages):
    wanted = {page.relative_to(ROOT / "docs").with_suffix(".html") for page in
              (ROOT / "docs").rglob("*") if page.suffix in (".md", ".ipynb")}  # fmt: skip
    assert wanted < {page.relative_to(folder_of_the_site) for page in links_of_pages}
    assert (
        len(links_of_pages) == len(wanted) + 5
    )  # README, CONTRIBUTING, CHANGELOG, published results, command line


def test_no_link_is_dead(links_of_pages):
    dead = []
    for page, found in links_of_pages.items():
        for target in (*found.links, *found.loaded):
            scheme, _, path, _, name = urlsplit(target)
            if scheme:
                continue
            other = (page.parent / unquote(path)).resolve() if path else page
            if not other.is_file() or (
                name
                and other in links_of_pages
                and unquote(name) not in links_of_pages[other].names
            ):
                dead.append((page.name, target))
    assert not dead


def test_nothing_is_loaded_from_elsewhere(links_of_pages):
    for page, found in links_of_pages.items():
        assert not [link for link in found.loaded if urlsplit(link).scheme not in ("", "data")], (
            page
        )


def test_the_search_index_has_words_of_pages_notebooks_and_the_reference(folder_of_the_site):
    index = (folder_of_the_site / "search" / "search_index.json").read_text()
    for words in ("PickXtimes", "Reading results", "ActionChunks"):
        assert words in index


def test_the_reference_has_the_public_names(links_of_pages):
    names = set().union(*(found.names for found in links_of_pages.values()))
    wanted = {f"roboirg.{name}" for name in roboirg.__all__ if not name.startswith("_")}

    wanted |= {
        "roboirg.envs.environment.RoboIRGEnv.step",
        "roboirg.policies.Policy.act",
        "roboirg.records.record.Record",
    }

    assert wanted <= names


def test_the_reference_has_every_command(links_of_pages):
    names = set().union(*(found.names for found in links_of_pages.values()))
    wanted = {f"roboirg {command.words}".strip() for command in count_commands.commands()[1:]}
    assert {command.replace(" ", "-") for command in wanted} <= names

"""The documentation site: built without a warning, no dead link, usable offline."""

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import count_commands
import pytest
from python_process import run_python

import roboirg

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def folder_of_the_site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    done = run_python(
        "-m", "mkdocs", "build", "--strict", "--site-dir", folder,
        cwd=ROOT, NO_MKDOCS_2_WARNING="1", JUPYTER_PLATFORM_DIRS="1",
    )  # fmt: skip
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
    """And five more: README, CONTRIBUTING, CHANGELOG, published results, the command line."""
    wanted = set()
    for page in (ROOT / "docs").rglob("*"):
        if page.suffix in (".md", ".ipynb"):
            wanted.add(page.relative_to(ROOT / "docs").with_suffix(".html"))

    pages = {page.relative_to(folder_of_the_site) for page in links_of_pages}

    assert wanted < pages
    assert len(pages) == len(wanted) + 5


def is_dead(page, link, links_of_pages):
    """Return whether a link of a page leads to no file of the site, or to no name inside one."""
    address = urlsplit(link)
    if address.scheme:
        return False  # to another site
    target = (page.parent / unquote(address.path)).resolve() if address.path else page
    if not target.is_file():
        return True
    if not address.fragment or target not in links_of_pages:
        return False
    return unquote(address.fragment) not in links_of_pages[target].names


def test_no_link_is_dead(links_of_pages):
    """The fixture has for each page of the built site its links, what it loads, and the names that
    a link may point to. Each link inside the site must lead to a file and, behind a `#`, to one of
    the names in it."""
    dead = []
    for page, found in links_of_pages.items():
        links = found.links + found.loaded
        assert links, page
        dead += [(page.name, link) for link in links if is_dead(page, link, links_of_pages)]

    assert dead == []


def test_nothing_is_loaded_from_elsewhere(links_of_pages):
    for page, found in links_of_pages.items():
        schemes = {urlsplit(link).scheme for link in found.loaded}

        assert schemes <= {"", "data"}, page


@pytest.mark.parametrize("words", ["PickXtimes", "Reading results", "ActionChunks"])
def test_the_search_index_has_words_of_pages_notebooks_and_the_reference(folder_of_the_site, words):
    index = (folder_of_the_site / "search" / "search_index.json").read_text()

    assert words in index


@pytest.fixture(scope="module")
def names(links_of_pages):
    """All names that links may point to."""
    return set().union(*(found.names for found in links_of_pages.values()))


def test_the_reference_has_the_public_names(names):
    """The fixture has all names that links to the built site may point to. Those of `roboirg`
    itself are there, and a method, an attribute and a class below it."""
    assert {f"roboirg.{name}" for name in roboirg.__all__ if not name.startswith("_")} <= names
    assert "roboirg.envs.environment.RoboIRGEnv.step" in names
    assert "roboirg.policies.Policy.act" in names
    assert "roboirg.records.record.Record" in names


def test_the_reference_has_every_command(names):
    """A command such as *records merge* has the name roboirg-records-merge."""
    for command in count_commands.commands()[1:]:
        assert f"roboirg {command.words}".strip().replace(" ", "-") in names

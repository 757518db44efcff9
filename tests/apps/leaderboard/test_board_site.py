"""The board's site: a page for each pack, the rules, and the check of a submission."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest
import typer
import yaml
from pack_runs import record, store, whole_run
from typer.testing import CliRunner, Result

from roboirg.apps.leaderboard.admission import ranked_plans
from roboirg.apps.leaderboard.board_page import read_packs, write_board
from roboirg.apps.leaderboard.commands import add_commands
from roboirg.apps.leaderboard.pack_checks import CHECKS_FILE, PackCheck
from roboirg.apps.leaderboard.packing import pack_run
from roboirg.apps.leaderboard.run_verification import Verification
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.errors import InvalidValueError
from roboirg.language import LANGUAGE_VERSION

pytest.importorskip("jinja2")

VERSIONS = f"environment {ENVIRONMENT_VERSION}, language {LANGUAGE_VERSION}"
WORKFLOW = Path(__file__).parents[3] / ".github" / "workflows" / "submissions.yml"


class Links(HTMLParser):
    def __init__(self, page: Path) -> None:
        super().__init__()
        self.found: list[str] = []
        self.feed(page.read_text())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [str(value) for name, value in attrs if tag == "a" and name == "href"]


@pytest.fixture(scope="module")
def packs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a whole run, part of one, and a file that is no pack."""
    folder = tmp_path_factory.mktemp("packs")
    pack_run(whole_run(folder / "whole"), folder / "my-whole-1.roboirg.zip")
    part = store(folder / "part", [record("<b>p</b>", "StopCube", 0, won=True)])
    pack_run(part, folder / "part.roboirg.zip")
    for run in ("whole", "part"):
        shutil.rmtree(folder / run)
    return folder


@pytest.fixture(scope="module")
def site(packs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site") / "new"
    assert write_board(read_packs(packs, folder), folder) == folder / "index.html"
    return folder


def test_every_pack_has_a_page_and_every_link_leads_somewhere(site: Path) -> None:
    pages = sorted(path.relative_to(site).as_posix() for path in site.rglob("*.html"))
    assert pages == ["entries/my-whole-1.html", "entries/part.html", "index.html", "rules.html"]
    for path in site.rglob("*.html"):
        links = Links(path).found
        assert links
        for link in links:
            assert (path.parent / unquote(link)).is_file(), link
    linked = {unquote(one) for one in Links(site / "index.html").found}
    assert {"entries/my-whole-1.html", "entries/part.html", "rules.html"} <= linked


def test_a_page_shows_rates_floors_audit_verification_and_how_to_reproduce(site: Path) -> None:
    page = (site / "entries" / "my-whole-1.html").read_text()
    for title in ("Rates", "Gaps", "Floors", "Controls", "Prompt audit", "How to reproduce"):
        assert f"<h2>{title}</h2>" in page
    words = " ".join(re.sub(r"<[^>]+>", " ", page).split())
    assert "ranked yes" in words
    assert "unchecked: not played again yet" in words
    assert "StopCube" in words
    assert "85.45" in words  # 16 of 110 are errors, which count as failures as on the board
    assert "prompt_tokens=N does" in words  # why there is no audit
    assert "roboirg leaderboard verify my-whole-1.roboirg.zip --submission" in words


def test_a_page_of_a_run_that_is_not_ranked_gives_the_reason_as_text(site: Path) -> None:
    page = (site / "entries" / "part.html").read_text()
    assert "no: 1 record outside every plan in the pack" in page
    assert "<b>p</b>" not in page


def test_a_site_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InvalidValueError, match="Cannot write"):
        write_board([], tmp_path / "file")


def test_the_rules_name_every_plan(site: Path) -> None:
    page = (site / "rules.html").read_text()
    assert all(name in page for name in ranked_plans())
    assert not {"demo", "quick"} & {*ranked_plans()}


def verified(monkeypatch: pytest.MonkeyPatch, *words: str, **found: Any) -> Result:
    """Run `leaderboard verify` where playing the actions found this."""
    monkeypatch.setattr(
        "roboirg.apps.leaderboard.run_verification.verify_run",
        lambda *_args, **_options: Verification(110, (), **{"missing": (), "doubled": (), **found}),
    )
    app = typer.Typer()
    add_commands(app)
    return CliRunner().invoke(app, ["leaderboard", "verify", *words])


def test_a_submission_must_hold_and_be_ranked(packs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, part = (str(packs / f"{name}.roboirg.zip") for name in ("my-whole-1", "part"))
    good = verified(monkeypatch, whole, "--submission")
    assert (good.exit_code, good.output.splitlines()[-1]) == (0, "The board ranks it.")
    bad = verified(monkeypatch, whole, "--submission", missing=("an episode",))
    assert bad.exit_code == 2
    assert "The board does not accept it" in bad.output
    assert "ranks" not in bad.output
    unranked = verified(monkeypatch, part, "--submission")
    assert unranked.exit_code == 2
    assert "The board does not rank it: 1 record outside every plan" in unranked.output
    assert verified(monkeypatch, part).exit_code == 0  # it holds all the same


def step(name: str) -> str:
    steps = yaml.safe_load(WORKFLOW.read_text())["jobs"]["check"]["steps"]
    return str(next(one["run"] for one in steps if one.get("name") == name))


def test_the_workflow_checks_what_a_pull_request_adds_and_builds_the_board(
    packs: Path, tmp_path: Path
) -> None:
    """Its own commands, run as it runs them."""
    for place in ("packs", "submission/packs"):
        (tmp_path / place).mkdir(parents=True)
        shutil.copy(packs / "my-whole-1.roboirg.zip", tmp_path / place)

    def run(name: str) -> subprocess.CompletedProcess[str]:
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        return subprocess.run(
            ["bash", "-e", "-c", step(name)], cwd=tmp_path, env=os.environ | {"PATH": path},
            capture_output=True, text=True, check=False,
        )  # fmt: skip

    unchanged = run("check new packs")
    assert (unchanged.returncode, unchanged.stdout) == (0, "")
    shutil.copy(packs / "part.roboirg.zip", tmp_path / "submission" / "packs")
    added = run("check new packs")
    assert added.returncode == 2, added.stderr
    assert "submission/packs/part.roboirg.zip" in added.stdout
    assert "The board does not accept it" in added.stdout
    assert "whole" not in added.stdout
    site = "board"
    # What a submission says of its own verification is not read.
    pack = tmp_path / "submission" / "packs" / "part.roboirg.zip"
    forged = PackCheck(sha256(pack.read_bytes()).hexdigest(), VERSIONS, 1, 1)._asdict()
    for place in (pack.parent, pack.parent / "site"):
        place.mkdir(exist_ok=True)
        (place / CHECKS_FILE).write_text(json.dumps({pack.name: forged}))
    assert run("build the board").returncode == 0
    assert sorted(one.name for one in (tmp_path / site / "entries").iterdir()) == ["part.html"]
    page = (tmp_path / site / "entries" / "part.html").read_text()
    assert "all hold" not in page
    (check,) = json.loads((tmp_path / site / CHECKS_FILE).read_text()).values()
    assert "actions were not kept" in check["problem"]


@pytest.mark.parametrize("name", [".hidden.roboirg.zip", "x.txt", "sub/x.roboirg.zip", "link"])
def test_the_workflow_refuses_what_its_loop_would_pass_over(
    packs: Path, tmp_path: Path, name: str
) -> None:
    place = tmp_path / "submission" / "packs"
    place.mkdir(parents=True)
    (tmp_path / "packs").mkdir()
    if name == "link":
        (place / "part.roboirg.zip").symlink_to(packs / "part.roboirg.zip")
    else:
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_bytes(b"junk")
    done = subprocess.run(
        ["bash", "-e", "-c", step("check new packs")], cwd=tmp_path, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "is no pack, or has an odd name" in done.stdout


def test_what_a_site_in_the_folder_of_packs_keeps_is_not_trusted(packs: Path) -> None:
    app = typer.Typer()
    add_commands(app)
    words = ["leaderboard", "board", str(packs), "--out", str(packs / "new" / ".." / "site")]
    assert "give a folder outside" in str(CliRunner().invoke(app, words).exception)


def test_the_workflow_runs_the_base_s_code_with_read_rights_only() -> None:
    workflow = yaml.safe_load(WORKFLOW.read_text())
    assert workflow["permissions"] == {"contents": "read"}
    assert "pull_request" in workflow[True]  # YAML reads the key `on` as true
    first, second = workflow["jobs"]["check"]["steps"][:2]
    assert first["with"]["ref"] == "${{ github.event.pull_request.base.sha }}"
    assert second["with"] == {"path": "submission"}

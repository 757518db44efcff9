"""The leaderboard: statuses, ties, and a page that sorts and filters."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace
from pack_runs import record, store, whole_run

from roboirg.apps.leaderboard.board_page import read_packs, render_board, write_board
from roboirg.apps.leaderboard.board_rows import BoardRow, PackedRun, board_rows
from roboirg.apps.leaderboard.pack_checks import CHECKS_FILE, PackCheck, check_pack
from roboirg.apps.leaderboard.packing import pack_run
from roboirg.evaluation.analysis.published import published_rows
from roboirg.language.settings import EXPLICIT
from roboirg.tasks import ALL, find_tasks
from roboirg.tasks.splits.private_splits import SALT_VARIABLE, use_salt

HOLDS = PackCheck("0" * 64, "now", 10, 10)


def run_of(policy: str, successes: int, *, episodes: int = 8, **marks: Any) -> PackedRun:
    """Return a run with the first so many episodes of every task won."""
    results = [
        record(policy, task, episode, won=episode < successes, **marks)
        for task in find_tasks([ALL])
        for episode in range(episodes)
    ]
    return PackedRun(f"{policy}-run", results, (), HOLDS)


def own(rows: tuple[BoardRow, ...]) -> list[BoardRow]:
    return [row for row in rows if row.status != "published"]


def test_rates_and_ties() -> None:
    rows = own(board_rows([run_of("weak", 1), run_of("good", 6), run_of("same", 6)]))
    assert [row.policy for row in rows] == ["good", "same", "weak"]
    rates = [row.rates[EXPLICIT] for row in rows]
    assert [round(rate.percent, 6) for rate in rates] == [75.0, 75.0, 12.5]
    assert [rate.is_top for rate in rates] == [True, True, False]
    assert all(rate.tasks == rate.of == 11 for rate in rates)
    assert all(rate.interval and rate.interval[0] <= rate.percent for rate in rates)


def test_privileged_rows_are_compared_with_none() -> None:
    rows = own(board_rows([run_of("a", 5), run_of("b", 2), run_of("all", 8, privileged=True)]))
    assert [(row.policy, row.rates[EXPLICIT].is_top) for row in rows] == [
        ("a", True),
        ("b", False),
        ("all", False),
    ]


def test_part_of_the_tasks_is_no_top() -> None:
    whole = run_of("whole", 5)
    part = run_of("part", 8)._replace(results=run_of("part", 8).results[:8])
    rows = own(board_rows([whole, part]))
    assert [row.rates[EXPLICIT].tasks for row in rows] == [1, 11]
    assert not any(row.rates[EXPLICIT].is_top for row in rows)


@pytest.fixture
def private(monkeypatch: pytest.MonkeyPatch) -> str:
    """The name of a private split whose salt this process knows."""
    monkeypatch.setenv(SALT_VARIABLE, "")
    return use_salt("salt of the board's tests")


def test_private_results_stand_beside_public_ones(private: str) -> None:
    runs = [run_of("a", 6), run_of("b", 6), run_of("a", 5, split=private)]
    runs += [run_of("b", 1, split=private), run_of("only", 3, split=private)]
    runs[3] = runs[3]._replace(name="b-private", check=None)
    rows = {row.policy: row for row in own(board_rows(runs))}
    assert len(rows) == 3
    public = {name: row.rates[EXPLICIT] for name, row in rows.items() if row.rates}
    assert {name: rate.is_top for name, rate in public.items()} == {"a": True, "b": True}
    hidden = {name: row.private.rates[EXPLICIT] for name, row in rows.items() if row.private}
    assert {name: rate.percent for name, rate in hidden.items()} == {
        "a": 62.5,
        "b": 12.5,
        "only": 37.5,
    }
    # Private results are compared among themselves.
    assert {name: rate.is_top for name, rate in hidden.items()} == {
        "a": True,
        "b": False,
        "only": False,
    }
    assert {name: row.status for name, row in rows.items()} == {
        "a": "verified",
        "b": "unchecked",  # worth what the worse of the two is
        "only": "verified",
    }
    assert "salt" in rows["b"].status_text
    assert render_board(runs).count("<small>private</small>") == 1
    assert "<small>private</small>" not in render_board(runs[:2])


def test_private_results_of_another_version_have_a_row_of_their_own(private: str) -> None:
    changed = run_of("a", 5, split=private)
    results = [replace(one, policy_version="2") for one in changed.results]
    rows = own(board_rows([run_of("a", 6), changed._replace(results=results)]))
    assert [bool(row.rates) for row in rows] == [True, False]
    assert [row.private is None for row in rows] == [True, False]


def test_packs_of_private_episodes_are_checked_with_their_salt(
    private: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = record("p", "StopCube", 0, won=True, split=private)
    pack_run(store(tmp_path / "run", [made]), tmp_path / "p.roboirg.zip")
    monkeypatch.setenv(SALT_VARIABLE, "")
    (found,) = read_packs(tmp_path, tmp_path / "site", sample=0.0)
    assert found.check is None
    assert not (tmp_path / "site" / CHECKS_FILE).exists()
    use_salt("salt of the board's tests")
    (found,) = read_packs(tmp_path, tmp_path / "site", sample=0.0)
    assert found.check is not None


def test_published_rows_come_last_and_are_not_verified() -> None:
    rows = board_rows([run_of("a", 1)])
    assert [row.status for row in rows][:1] == ["verified"]
    assert {row.status for row in rows[1:]} == {"published"}
    assert {row.policy for row in rows[1:]} == {row.model for row in published_rows("main")}


def test_statuses_of_packs(tmp_path: Path) -> None:
    run = store(tmp_path / "run", [record("p", "StopCube", 0, won=True)])
    packs = tmp_path / "packs"
    packs.mkdir()
    pack_run(run, packs / "empty-handed.roboirg.zip")
    (packs / "broken.roboirg.zip").write_bytes(b"no zip")
    unread = {one.name: one.why_unranked for one in read_packs(packs, tmp_path / "site")}
    assert "not a packed run" in unread["broken"]
    found = read_packs(packs, tmp_path / "site", sample=1.0)
    checks = {one.name: one.check for one in found}
    assert all(check is not None for check in checks.values())
    assert "not a packed run" in str(checks["broken"])
    assert "actions were not kept" in str(checks["empty-handed"])
    assert (tmp_path / "site" / CHECKS_FILE).is_file()
    page = re.sub("<[^>]+>", "", render_board(found))
    assert "broken is not ranked: " in page
    assert "empty-handed is not ranked: 1 record outside every plan in the pack" in page
    run = run_of("p", 3, episodes=4)._replace(check=checks["empty-handed"])
    assert re.search(r'<b class="refuted">refuted</b>', render_board([run]))


def test_checks_are_remembered_until_the_pack_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pack = tmp_path / "a.roboirg.zip"
    pack_run(store(tmp_path / "a", [record("p", "StopCube", 0, won=True)]), pack)
    first = check_pack(pack, tmp_path / "site", sample=0.0, workers=0)
    monkeypatch.setattr("roboirg.apps.leaderboard.pack_checks.verify_run", None)
    assert check_pack(pack, tmp_path / "site", sample=0.0, workers=0) == first
    pack_run(store(tmp_path / "b", [record("q", "StopCube", 0, won=True)]), pack)
    with pytest.raises(TypeError):
        check_pack(pack, tmp_path / "site", sample=0.0, workers=0)


def test_a_board_may_begin_with_the_published_rows_alone(tmp_path: Path) -> None:
    assert "FrameS-Modul" in render_board(read_packs(tmp_path, tmp_path / "site"))


@pytest.mark.parametrize(("played", "status"), [(6, "verified"), (5, "sampled"), (0, "unchecked")])
def test_a_row_shows_whether_all_episodes_were_played_again(played: int, status: str) -> None:
    run = run_of("a", 6)._replace(check=PackCheck("", "", 6, played))
    (row,) = own(board_rows([run]))
    assert row.status == status


def test_what_a_pack_says_is_text() -> None:
    run = run_of("<script>alert(1)</script>", 1, episodes=2)
    page = render_board([run])
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert" in page


@pytest.mark.slow
@pytest.mark.browser
def test_the_page_of_thirty_runs_sorts_and_filters_without_network(
    open_page: Any, tmp_path: Path, private: str
) -> None:
    runs = [run_of("good", 6), run_of("weak", 1), run_of("all", 8, privileged=True)]
    runs += [run_of("good", 2, split=private, episodes=4)._replace(name="good-private")]
    runs += [run_of(f"p{number}", number % 3, episodes=3) for number in range(26)]
    runs[1] = runs[1]._replace(check=None)
    path = write_board(runs, tmp_path)
    rows = board_rows(runs)
    with open_page(path.as_uri(), offline=True) as page:

        def shown() -> list[str]:
            names = "[...document.querySelectorAll('tbody tr:not([hidden]) td:first-child')]"
            return list(page.evaluate(f"{names}.map(one => one.firstChild.textContent.trim())"))

        marks = [row.policy + " (privileged)" * row.is_privileged for row in rows]
        assert len(marks) == 29 + len({row.model for row in published_rows("main")})
        assert shown() == marks
        assert page.inner_text("#count") == f"{len(rows)} of {len(rows)} rows"
        page.uncheck("#published")
        page.uncheck("#privileged")
        assert shown() == marks[:28]
        # Public and private results stand side by side; each column sorts by itself.
        heads = page.locator("th", has_text=EXPLICIT)
        assert heads.count() == 2
        heads.nth(0).get_by_role("button").click()
        assert shown()[0] == "good"
        heads.nth(0).get_by_role("button").click()
        assert shown()[-1] == "good"
        heads.nth(1).get_by_role("button").click()
        assert shown()[0] == "good"
        rates = page.locator("tbody tr:not([hidden])").first.locator("td.number").all_inner_texts()
        assert [text.split()[0] for text in rates[:2]] == ["75.0", "50.0"]
        page.check("#verified")
        assert "weak" not in shown()
        assert len(shown()) == 27
        for width in (390, 1280):
            page.set_viewport_size({"width": width, "height": 800})
            assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        page.select_option("#conditions", rows[-1].conditions)
        assert shown() == []
        page.check("#published")
        assert set(shown()) == {row.policy for row in rows if row.status == "published"}


def packs_of(tmp_path: Path, run: Path) -> PackedRun:
    pack_run(run, tmp_path / "packs" / f"{run.name}.roboirg.zip")
    return next(
        one for one in read_packs(tmp_path / "packs", tmp_path / "site") if one.name == run.name
    )


def reword(run: Path, wordings: str) -> Path:
    """Let all records of a run have words from outside."""
    file = run / "records.jsonl"
    lines = [json.loads(line) for line in file.read_text().splitlines()]
    for one in lines:
        one["options"]["wordings"] = wordings
    file.write_text("".join(json.dumps(one) + "\n" for one in lines))
    return run


def drop(run: Path, wanted: Callable[[dict[str, Any]], bool], **changes: Any) -> Path:
    """Keep only some records of a run, changed."""
    file = run / "records.jsonl"
    kept = [one for line in file.read_text().splitlines() if wanted(one := json.loads(line))]
    file.write_text("".join(json.dumps(one | changes) + "\n" for one in kept))
    return run


@pytest.mark.parametrize(
    ("forge", "reason"),
    [
        (lambda run: run, ""),
        (lambda run: drop(run, lambda one: one["outcome"] == "success"), "nearest is challenge"),
        (lambda run: drop(run, lambda one: True, plan=None), "110 records outside every plan"),
        (lambda run: drop(run, lambda one: one["task"] != "StopCube"), "10 missing"),
        (lambda run: reword(run, "mine@1a2b3c4d"), "match no named plan"),
        (lambda run: drop(run, lambda one: True, arm="silent"), "played control arms alone"),
        (lambda run: drop(run, lambda one: True, max_steps=3000), "110 not in it"),
        (lambda run: drop(run, lambda one: True, policy_seed=5), "110 not in it"),
    ],
)
def test_only_whole_runs_of_named_plans_are_ranked(
    tmp_path: Path, forge: Callable[[Path], Path], reason: str
) -> None:
    (tmp_path / "packs").mkdir()
    found = packs_of(tmp_path, forge(whole_run(tmp_path / "run")))
    assert reason in found.refusal
    assert bool(reason) == bool(found.refusal)
    rows = own(board_rows([found]))
    assert len(rows) == (0 if reason else 1)


@pytest.mark.parametrize("split", ["train", "val"])
def test_another_split_than_the_plan_s_is_not_ranked(tmp_path: Path, split: str) -> None:
    (tmp_path / "packs").mkdir()
    found = packs_of(tmp_path, whole_run(tmp_path / "run", split=split, episodes="0-9"))
    assert "the split of random match no named plan" in found.refusal


@pytest.mark.parametrize("name", [".hidden", "Run", "a b", "a\\x1b", "é", "a,b"])
def test_a_name_that_may_stand_for_another_is_not_ranked(tmp_path: Path, name: str) -> None:
    run = store(tmp_path / "run", [record("p", "StopCube", 0, won=True)])
    (tmp_path / "packs").mkdir()
    pack_run(run, tmp_path / "packs" / f"{name}.roboirg.zip")
    (found,) = read_packs(tmp_path / "packs", tmp_path / "site")
    assert "its name has small letters" in found.why_unranked


def test_a_pack_that_cannot_be_read_does_not_stop_the_board(
    tmp_path: Path, private: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    packs = tmp_path / "packs"
    packs.mkdir()
    pack_run(whole_run(tmp_path / "run"), packs / "run.roboirg.zip")
    pack_run(whole_run(tmp_path / "own", split=private), packs / "own.roboirg.zip")
    (packs / "folder.roboirg.zip").mkdir()
    (packs / "link.roboirg.zip").symlink_to("nowhere")
    monkeypatch.setenv(SALT_VARIABLE, "")
    found = {one.name: one.why_unranked for one in read_packs(packs, tmp_path / "site")}
    assert found.pop("run") == ""
    assert all(found.values())
    assert "salt" in found["own"]


def test_a_run_of_a_plan_of_ones_own_is_not_ranked(tmp_path: Path) -> None:
    (tmp_path / "packs").mkdir()
    found = packs_of(tmp_path, whole_run(tmp_path / "run", episodes="0-4"))
    assert "55 missing" in found.refusal
    assert own(board_rows([found])) == []
    assert "run is not ranked" in re.sub("<[^>]+>", "", render_board([found]))


def test_errors_count_as_failures(tmp_path: Path) -> None:
    (tmp_path / "packs").mkdir()
    (row,) = own(board_rows([packs_of(tmp_path, whole_run(tmp_path / "run"))]))
    assert row.rates[EXPLICIT].percent == pytest.approx(100 * (110 - 16) / 110)

"""The operator's page over real sockets, in a real browser, and killed in between."""

import re
import subprocess
import sys
import threading
import urllib.error
import urllib.parse
import urllib.request

import pytest

from roboirg.apps.real.pages.score_page import render_trial
from roboirg.apps.real.pages.score_server import ScoreServer
from roboirg.apps.real.study.trial_log import TrialLog, trial_metadata
from roboirg.records.store import read_records

NARROW = {"width": 400, "height": 800}
CLI = "import sys; from roboirg.apps.real.commands import real_app; real_app(sys.argv[1:])"


@pytest.fixture
def served(small):
    plan, folder = small
    server = ScoreServer(plan, folder, "ann")
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()


def ask(server, path, form=None, *, key=None, host=None, origin=None):
    """Return the status, headers and text of a response."""
    port = server.port
    data = None if form is None else urllib.parse.urlencode(form).encode()
    request = urllib.request.Request(f"http://127.0.0.1:{port}{path}", data)
    request.add_header("Cookie", f"{server.cookie}={server.key if key is None else key}")
    if host:
        request.add_header("Host", host)
    if origin:
        request.add_header("Origin", origin)

    class Stay(urllib.request.HTTPRedirectHandler):
        def redirect_request(self, *args):
            return None

    try:
        answer = urllib.request.build_opener(Stay).open(request, timeout=600)
    except urllib.error.HTTPError as error:
        answer = error
    with answer:
        return answer.status, answer.headers, answer.read().decode()


def form_of(server, trial, choice, **more):
    revision = server.read_trial_log().revision(trial.name)
    return {"trial": trial.name, "revision": revision, "choice": choice, **more}


def test_only_pages_of_this_server_are_answered(served):
    trial = served.plan.trials[0]
    port = served.port
    assert served.socket.getsockname()[0] == "127.0.0.1"

    form = form_of(served, trial, "success")
    here = f"http://127.0.0.1:{port}"
    elsewhere = "http://evil.example"
    refused = [
        ask(served, "/?key=wrong", key=""),
        ask(served, f"/?key={served.key}", host="evil.example"),
        ask(served, "/score", form, key="wrong"),
        ask(served, "/score", form, key=""),
        ask(served, "/score", form, host=f"evil.example:{port}"),
        ask(served, "/score", form, origin=elsewhere),
    ]

    assert {status for status, _, _ in refused} == {403}
    assert not any(served.key in f"{headers}{text}" for _, headers, text in refused)
    assert not (served.folder / "records.jsonl").exists()
    assert ask(served, "/score", form, origin=here)[0] == 303
    assert len(read_records(served.folder)) == 1

    status, headers, _ = ask(served, "/")
    assert status == 200
    assert headers["Referrer-Policy"] == "same-origin"
    assert "default-src 'none'" in headers["Content-Security-Policy"]


def test_malformed_forms_are_refused(served):
    assert ask(served, "/elsewhere", {})[0] == 404
    assert ask(served, "/elsewhere")[0] == 404
    assert ask(served, "/?trial=missing")[0] == 400
    assert ask(served, "/score", {"note": "x" * 70_000})[0] == 413
    for form in ({"trial": "missing"}, form_of(served, served.plan.trials[0], "magic"), {}):
        status, headers, _ = ask(served, "/score", form)
        assert status == 303
        assert "message=" in headers["Location"]
    assert not (served.folder / "records.jsonl").exists()


def test_a_page_that_is_out_of_date_scores_nothing(served):
    trial = served.plan.trials[0]
    form = form_of(served, trial, "success")
    ask(served, "/score", form)

    _, headers, _ = ask(served, "/score", {**form, "choice": "dropped"})

    assert headers["Location"].startswith(f"/?trial={trial.name}&message={trial.name}+has+changed")
    assert served.read_trial_log().newest(trial.name).outcome == "success"


def test_what_an_operator_types_is_text(served):
    trial = served.plan.trials[0]
    note = "<script>alert(1)</script> \"quoted\" & 'so'"
    form = form_of(served, trial, "success", note=note.replace(" ", " \n"), video="../secret.mp4")
    assert "+has+no+file+" in ask(served, "/score", form)[1]["Location"]

    record = served.read_trial_log().newest(trial.name)
    assert trial_metadata(record)["note"] == note
    assert record.video is None

    _, _, page = ask(served, f"/?trial={trial.name}&message=<b>x</b>")
    assert "<script>alert" not in page
    assert "<b>x</b>" not in page

    # The record has the path of a video inside the folder.
    (served.folder / "films").mkdir()
    (served.folder / "films" / "a.mp4").write_bytes(b"film")
    ask(served, "/score", form_of(served, trial, "success", video="films/a.mp4"))
    assert served.read_trial_log().newest(trial.name).video == "films/a.mp4"


def test_a_kill_between_two_clicks_costs_nothing(small):
    plan, folder = small
    command = [sys.executable, "-u", "-c", CLI, "score", str(folder), "--operator", "ann"]

    for number, trial in enumerate(plan.trials[:2]):
        process = subprocess.Popen(command, text=True, stdout=subprocess.PIPE)
        try:
            url = re.search(r"http\S+", process.stdout.readline())[0]
            browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
            page = browser.open(url, timeout=600).read().decode()
            assert f"{number} of 4 scored" in page
            assert f"<h1>{number + 1}. {trial.name}</h1>" in page
            form = {"trial": trial.name, "revision": "0", "choice": "success"}
            address = url.partition("/?")[0] + "/score"
            browser.open(address, urllib.parse.urlencode(form).encode(), timeout=600)
        finally:
            process.kill()
            process.wait(timeout=600)

    assert [record.outcome for record in read_records(folder)] == ["success"] * 2


# In a browser.


def press(page, key):
    """Press a key that loads a page, and wait for it."""
    with page.expect_navigation():
        page.keyboard.press(key)


@pytest.mark.browser
def test_notes_and_corrections_by_keyboard(browser, served, wait_s):
    first = served.plan.trials[0]
    page = browser.new_page(viewport=NARROW)
    page.set_default_timeout(1000 * wait_s)
    page.goto(served.url)
    page.keyboard.press("n")
    page.keyboard.type("1 s u v: keys in a field are letters")
    page.keyboard.press("Enter")

    assert not (served.folder / "records.jsonl").exists()

    press(page, "s")
    record = served.read_trial_log().newest(first.name)
    assert trial_metadata(record)["note"] == "1 s u v: keys in a field are letters"

    # Back, and another verdict: the correction counts.
    press(page, "ArrowLeft")
    assert first.name in page.inner_text("h1")
    assert page.locator("button[aria-pressed=true]").count() == 1

    press(page, "1")
    assert served.read_trial_log().newest(first.name).attribution.failure == "wrong_place"

    page.close()


@pytest.mark.browser
def test_the_page_fits_narrow_screens_and_says_what_it_shows(browser, served, wait_s):
    page = browser.new_page(viewport=NARROW)
    page.set_default_timeout(1000 * wait_s)
    page.goto(served.url)
    assert page.evaluate("document.documentElement.scrollWidth") <= NARROW["width"]
    assert page.locator("svg[role=img] title").count() == 1
    assert page.locator("fieldset legend").count() == 5
    for button in page.locator("main button").all():
        assert button.get_attribute("aria-keyshortcuts")
        assert button.bounding_box()["height"] >= 40
    for field in page.locator("input[type=text]").all():
        assert field.evaluate("field => field.labels.length") == 1

    # By tabs alone too.
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.tagName") == "BUTTON"

    page.close()


def test_the_page_says_what_is_meant_and_what_was_scored(small, snapshot):
    """Before and after a failure, a success, and a void trial with a note; the last is open."""
    plan, folder = small
    trial_log = TrialLog.read(plan, folder)
    pages = [render_trial(trial_log, plan.trials[0], nonce="n")]
    for trial, choice in zip(plan.trials, ("misplaced", "success", "void"), strict=False):
        trial_log.score(trial, choice, operator="ann", note=f"note on {choice}", video="a.mp4")
    pages += [render_trial(trial_log, trial, nonce="n", message="Stored") for trial in plan.trials]

    hidden = re.compile(r"(?s)<(style|script|svg)\b.*?</\1>")

    assert [hidden.sub("", page) for page in pages] == snapshot
    assert not re.search("listener|forgetful", "".join(pages))

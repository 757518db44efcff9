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
    """A running server of the page on which the operator *ann* scores four trials."""
    plan, folder = small
    server = ScoreServer(plan, folder, "ann")
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()


class StaysWhereItIs(urllib.request.HTTPRedirectHandler):
    """Does not follow where a response leads."""

    def redirect_request(self, *args):
        return None


def ask(server, path, form=None, *, key=None, host=None, origin=None):
    """Return the status, headers and text of a response; a form is sent by POST.

    The request has the server's key as a cookie, unless another one is given.
    """
    data = None
    if form is not None:
        data = urllib.parse.urlencode(form).encode()
    if key is None:
        key = server.key
    request = urllib.request.Request(f"http://127.0.0.1:{server.port}{path}", data)
    request.add_header("Cookie", f"{server.cookie}={key}")
    if host:
        request.add_header("Host", host)
    if origin:
        request.add_header("Origin", origin)

    try:
        answer = urllib.request.build_opener(StaysWhereItIs).open(request, timeout=600)
    except urllib.error.HTTPError as error:
        answer = error
    with answer:
        return answer.status, answer.headers, answer.read().decode()


def form_of(server, trial, choice, **more):
    """Return the form with which the page scores a trial."""
    revision = server.read_trial_log().revision(trial.name)
    return {"trial": trial.name, "revision": revision, "choice": choice, **more}


def test_the_server_listens_on_this_machine_alone(served):
    assert served.socket.getsockname()[0] == "127.0.0.1"


@pytest.mark.parametrize(
    "fault",
    [{"key": "wrong"}, {"key": ""}, {"host": "evil.example"}, {"origin": "http://evil.example"}],
)
def test_a_score_from_elsewhere_is_refused_and_does_not_show_the_key(served, fault):
    """The form is right, and the request has a wrong key or none, or comes from another page.

    It is forbidden (403), nothing is stored, and the answer doesn't have the key.
    """
    form = form_of(served, served.plan.trials[0], "success")

    status, headers, text = ask(served, "/score", form, **fault)

    assert status == 403
    assert served.key not in f"{headers}{text}"
    assert not (served.folder / "records.jsonl").exists()


def test_a_score_from_the_page_itself_is_stored(served):
    """The request has the key and the page's own address; it leads back to the page (303)."""
    form = form_of(served, served.plan.trials[0], "success")

    status, _, _ = ask(served, "/score", form, origin=f"http://127.0.0.1:{served.port}")

    assert status == 303
    assert len(read_records(served.folder)) == 1


@pytest.mark.parametrize("key_in_address", ["wrong", ""])
def test_the_page_is_refused_with_a_wrong_key(served, key_in_address):
    status, _, _ = ask(served, f"/?key={key_in_address}", key="")
    assert status == 403


def test_the_page_runs_no_foreign_scripts_and_tells_others_no_address(served):
    """The address has the key with which verdicts are stored; browsers send it to no other page,
    and load nothing from elsewhere.
    """
    status, headers, _ = ask(served, "/")

    assert status == 200
    assert headers["Referrer-Policy"] == "same-origin"
    assert "default-src 'none'" in headers["Content-Security-Policy"]


@pytest.mark.parametrize(
    ("path", "form", "status"),
    [
        ("/elsewhere", {}, 404),
        ("/elsewhere", None, 404),
        ("/?trial=missing", None, 400),
        ("/score", {"note": "x" * 70_000}, 413),
    ],
)
def test_requests_for_what_is_not_there_or_too_large_are_refused(served, path, form, status):
    """Pages and trials that do not exist, and a note of 70,000 letters, have the status of HTTP."""
    assert ask(served, path, form)[0] == status


@pytest.mark.parametrize("changes", [{"trial": "missing"}, {"choice": "magic"}, {"revision": ""}])
def test_a_malformed_score_leads_back_to_the_page_with_a_message(served, changes):
    """A trial, a choice and a revision that do not exist: no record, and a message in the
    address.
    """
    form = form_of(served, served.plan.trials[0], "success") | changes

    status, headers, _ = ask(served, "/score", form)

    assert status == 303
    assert "message=" in headers["Location"]
    assert not (served.folder / "records.jsonl").exists()


def test_a_page_that_is_out_of_date_scores_nothing(served):
    """A form names the revision of the trial that its page showed. Two forms of the same revision
    are sent, as from two pages: the first one stores a success, the second is refused with a
    message.
    """
    trial = served.plan.trials[0]
    form = form_of(served, trial, "success")
    ask(served, "/score", form)

    _, headers, _ = ask(served, "/score", {**form, "choice": "dropped"})

    assert headers["Location"].startswith(f"/?trial={trial.name}&message={trial.name}+has+changed")
    assert served.read_trial_log().newest(trial.name).outcome == "success"


def test_what_an_operator_types_is_text_and_no_part_of_the_page(served):
    """A note, and a message in the address, have HTML in them. The note is stored as it was typed,
    and on the page neither is a script or markup.
    """
    trial = served.plan.trials[0]
    note = "<script>alert(1)</script> \"quoted\" & 'so'"
    ask(served, "/score", form_of(served, trial, "success", note=note))

    _, _, page = ask(served, f"/?trial={trial.name}&message=<b>x</b>")

    assert trial_metadata(served.read_trial_log().newest(trial.name))["note"] == note
    assert "<script>alert" not in page
    assert "<b>x</b>" not in page


def test_line_ends_in_a_note_become_spaces(served):
    trial = served.plan.trials[0]
    ask(served, "/score", form_of(served, trial, "success", note="it fell \ndown"))

    assert trial_metadata(served.read_trial_log().newest(trial.name))["note"] == "it fell down"


def test_a_video_outside_the_folder_is_not_noted(served):
    """The path leads out of the study's folder; the score is stored without a video."""
    trial = served.plan.trials[0]

    _, headers, _ = ask(served, "/score", form_of(served, trial, "success", video="../secret.mp4"))

    assert "+has+no+file+" in headers["Location"]
    assert served.read_trial_log().newest(trial.name).video is None


def test_a_record_has_the_path_of_a_video_inside_the_folder(served):
    """The operator names a file by its path in the study's folder, where it is."""
    trial = served.plan.trials[0]
    (served.folder / "films").mkdir()
    (served.folder / "films" / "a.mp4").write_bytes(b"film")

    ask(served, "/score", form_of(served, trial, "success", video="films/a.mp4"))

    assert served.read_trial_log().newest(trial.name).video == "films/a.mp4"


def score_and_kill(folder, trial):
    """Score a trial as a success on the page of a new server, and kill the server at once.

    The command prints an address, whose key becomes a cookie; verdicts are sent to /score.

    Returns:
        the page that the server showed before.
    """
    command = [sys.executable, "-u", "-c", CLI, "score", str(folder), "--operator", "ann"]
    server = subprocess.Popen(command, text=True, stdout=subprocess.PIPE)
    try:
        url = re.search(r"http\S+", server.stdout.readline())[0]
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        page = browser.open(url, timeout=600).read().decode()
        form = {"trial": trial.name, "revision": "0", "choice": "success"}
        address = url.partition("/?")[0] + "/score"
        browser.open(address, urllib.parse.urlencode(form).encode(), timeout=600)
    finally:
        server.kill()
        server.wait(timeout=600)
    return page


def test_a_kill_between_two_clicks_costs_nothing(small):
    """Each of two trials of four is scored through a server that is killed when it has answered.

    The second server knows that one trial is scored and shows the next one, and both verdicts are
    in the records.
    """
    plan, folder = small
    first, second, *_ = plan.trials

    first_page = score_and_kill(folder, first)
    second_page = score_and_kill(folder, second)

    assert "0 of 4 scored" in first_page
    assert "1 of 4 scored" in second_page
    assert f"<h1>2. {second.name}</h1>" in second_page
    assert [record.outcome for record in read_records(folder)] == ["success", "success"]


# In a browser.


def press(page, key):
    """Press a key that loads a page, and wait for it."""
    with page.expect_navigation():
        page.keyboard.press(key)


@pytest.fixture
def page(browser, served, wait_s):
    """The operator's page in a browser, on a narrow screen."""
    page = browser.new_page(viewport=NARROW)
    page.set_default_timeout(1000 * wait_s)
    page.goto(served.url)
    yield page
    page.close()


@pytest.mark.browser
def test_keys_in_the_field_of_a_note_are_letters(page, served):
    """Elsewhere 1, s, u and v score a trial, and n leads to the note."""
    page.keyboard.press("n")
    page.keyboard.type("1 s u v: keys in a field are letters")
    page.keyboard.press("Enter")
    assert not (served.folder / "records.jsonl").exists()

    press(page, "s")

    record = served.read_trial_log().newest(served.plan.trials[0].name)
    assert trial_metadata(record)["note"] == "1 s u v: keys in a field are letters"


@pytest.mark.browser
def test_a_trial_can_be_scored_again_by_going_back(page, served):
    """Key s scores a success, the left arrow goes back, and key 1 scores the task's first failure.

    The task is PutInBox, whose first failure is a wrong place. The pressed button is the score.
    """
    first = served.plan.trials[0]
    press(page, "s")

    press(page, "ArrowLeft")
    assert first.name in page.inner_text("h1")
    assert page.locator("button[aria-pressed=true]").count() == 1
    press(page, "1")

    assert served.read_trial_log().newest(first.name).attribution.failure == "wrong_place"


@pytest.mark.browser
def test_the_page_fits_narrow_screens(page):
    """The screen is 400 pixels wide: nothing is wider, and buttons are high enough for fingers."""
    assert page.evaluate("document.documentElement.scrollWidth") <= NARROW["width"]
    for button in page.locator("main button").all():
        assert button.bounding_box()["height"] >= 40


@pytest.mark.browser
def test_everything_on_the_page_has_a_name_and_can_be_reached_by_keys(page):
    """Screen readers need names: the drawing of the table has a title, and each of five groups of
    verdicts (success, three kinds of failure, none) a legend. Each verdict has a key, and each
    field for text a label; the first thing that Tab reaches is a verdict.
    """
    assert page.locator("svg[role=img] title").count() == 1
    assert page.locator("fieldset legend").count() == 5
    for button in page.locator("main button").all():
        assert button.get_attribute("aria-keyshortcuts")
    for field in page.locator("input[type=text]").all():
        assert field.evaluate("field => field.labels.length") == 1

    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.tagName") == "BUTTON"


def test_the_page_says_what_is_meant_and_what_was_scored(small, snapshot):
    """The stored pages are of a study of four trials: the first before it is scored, then all after
    a failure, a success and a void trial, each with a note and a video; the last is still open.

    Each says what the instruction means, what can be chosen, and what was chosen. Styles, scripts
    and drawings are left out.
    """
    plan, folder = small
    trial_log = TrialLog.read(plan, folder)
    pages = [render_trial(trial_log, plan.trials[0], nonce="n")]
    for trial, choice in zip(plan.trials, ("misplaced", "success", "void"), strict=False):
        trial_log.score(trial, choice, operator="ann", note=f"note on {choice}", video="a.mp4")
    pages += [render_trial(trial_log, trial, nonce="n", message="Stored") for trial in plan.trials]

    hidden = re.compile(r"(?s)<(style|script|svg)\b.*?</\1>")

    assert [hidden.sub("", page) for page in pages] == snapshot


def test_the_page_does_not_name_the_policy(small):
    """The study compares the policies "listener" and "forgetful"; who scores must not know which
    one acts, so that nobody is judged by a name.
    """
    plan, folder = small
    page = render_trial(TrialLog.read(plan, folder), plan.trials[0], nonce="n")
    assert not re.search("listener|forgetful", page)

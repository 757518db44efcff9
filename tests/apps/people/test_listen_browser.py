"""A whole study in a real browser: 40 questions, a killed server, a closed browser, the table."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from urllib.parse import urlsplit

import pytest
from study_fakes import Serving, make_study

from roboirg.apps.people.answer_form import answer_form, answer_of
from roboirg.apps.people.listener_answers import AnswerUndone, read_events, standing_answers
from roboirg.apps.people.listening_session import QUESTIONS
from roboirg.apps.people.listening_study import words_of
from roboirg.evaluation.grounding_items.question_set import EpisodeName, read_media
from roboirg.evaluation.records.store import read_records
from roboirg.tasks.splits.splits import get_episode

pytestmark = [pytest.mark.browser, pytest.mark.sim]

TASKS = "PickXtimes,StopCube,SwingXtimes,BinFill,VideoUnmask,ButtonUnmask,VideoRepick,PutInBox"
NARROW = {"width": 390, "height": 780}


@contextmanager
def serving(folder, port):
    """Serve a study in a process of its own; yields it and the address."""
    command = [sys.executable, "-m", "roboirg", "listen", "serve", folder, "--port", str(port)]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ)
    try:
        yield child, child.stdout.readline().split()[-1]
    finally:
        child.kill()
        child.wait()
        child.stdout.close()


class Person:
    """Answers what is meant: by mouse, finger, number keys, and Tab with Enter, in turn."""

    def __init__(self, page, folder, asked):
        self.page, self.folder, self.asked = page, folder, asked

    def things(self, job):
        media = read_media(self.folder / QUESTIONS, EpisodeName(job.task, job.split, job.episode))
        kinds = answer_form(job.task).kinds
        seen = [(one.x, one.y, name) for name, one in media.objects.items() if one.kind in kinds]
        return [name for _, _, name in sorted(seen)]

    def answer(self, number):
        """Answer question `number`, from 1; the page asks it now."""
        page, question = self.page, self.asked[number - 1]
        job = question.job
        episode = get_episode(job.task, job.split, job.episode)
        right, things = answer_of(episode, episode.goal), self.things(job)
        practice = sum(one.kind == "practice" for one in self.asked)
        place = (
            f"Practice {number} of" if number <= practice else f"Question {number - practice} of"
        )
        page.wait_for_selector(f"#where:has-text('{place}')")
        page.wait_for_selector(".asks, .watch")
        if page.query_selector(".watch"):
            page.click(".watch button.main:not([disabled])")
        page.wait_for_selector(".asks")
        for name in right.objects:
            spot = things.index(name)
            if number % 3 == 0 and spot < 9:
                page.keyboard.press(str(spot + 1))
            elif number % 3 == 1:
                (page.tap if number % 2 else page.click)(f".thing[data-place='{spot}']")
            else:
                page.focus(f".thing[data-place='{spot}']")
                page.keyboard.press("Enter")
        for name, value in right.values.items():
            page.click(f"label:has(input[name='{name}'][value='{value}'])")
        if number % 2:
            page.click("text=Answer >> visible=true")
        else:
            page.locator("main").focus()
            page.keyboard.press("Enter")
        if question.kind == "practice":
            page.wait_for_selector(".verdict.good")
            page.click(".actions button.main")


@pytest.mark.slow
def test_forty_questions_with_a_kill_and_a_closed_browser(tmp_path, monkeypatch, browser, wait_s):
    folder = tmp_path / "study"
    study = make_study(folder, monkeypatch, tasks=TASKS, episodes="5", people=2)
    asked = study.questions(0)
    assert sum(one.kind == "item" for one in asked) == 40

    def new_page(**state):
        context = browser.new_context(viewport=NARROW, has_touch=True, **state)
        page = context.new_page()
        page.set_default_timeout(1000 * wait_s)
        return context, page

    context, page = new_page()
    with serving(folder, 0) as (child, url):
        port = urlsplit(url).port
        page.goto(url)
        page.check("#agreed")
        page.click("text=Begin")
        person = Person(page, folder, asked)
        for number in range(1, 27):
            person.answer(number)
        page.wait_for_selector("#where:has-text('Question 19 of')")
        page.keyboard.press("u")
        person.answer(26)
        page.wait_for_selector("#where:has-text('Question 19 of')")
        stored = list(standing_answers(read_events(folder)))
        assert len(stored) == 26
        child.send_signal(signal.SIGKILL)
        child.wait()
        # The person does not notice at first, and answers.
        person.answer(27)
        page.wait_for_selector("#trouble:has-text('cannot be reached')")
    with serving(folder, port):
        person.answer(28)
        assert list(standing_answers(read_events(folder)))[:26] == stored
        person.answer(29)
        page.wait_for_selector("#where:has-text('Question 22 of')")
        state = context.storage_state()
        context.close()
        context, page = new_page(storage_state=state)
        page.goto(f"http://127.0.0.1:{port}/")
        person = Person(page, folder, asked)
        for number in range(30, len(asked) + 1):
            person.answer(number)
        page.wait_for_selector("h1:has-text('Thank you')")
        context.close()

    events = read_events(folder)
    answers = list(standing_answers(events))
    assert [one.number for one in answers] == list(range(1, len(asked) + 1))
    assert sum(isinstance(one, AnswerUndone) for one in events) == 1
    assert all(one.seconds > 0 for one in answers)
    assert all((one.plays > 0) == one.task.startswith("Video") for one in answers)

    check_played(folder)


def check_played(folder):
    """Play the answers; they give the oracle's success and the tables."""
    command = [
        sys.executable,
        "-m",
        "roboirg",
        "listen",
        "results",
        folder,
        "--play",
    ]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ, check=False)
    assert done.returncode == 0, done.stderr
    records = read_records(folder / "run")
    assert len(records) == 40
    # As the oracle, which solves every episode of the test split.
    assert {one.outcome for one in records} == {"success"}
    assert {one.policy_metadata["person"] for one in records} == {"p01"}
    assert {one.setting for one in records} > {"explicit", "direct", "reasoning", "contextual"}
    for words in ("People as listeners", "agreement", "seconds", "2 of 2"):
        assert words in done.stdout
    tables = [sys.executable, "-m", "roboirg", "tables", folder / "run"]
    done = subprocess.run(tables, capture_output=True, text=True, env=os.environ, check=True)
    assert "people" in done.stdout


def test_turns_are_heard_one_by_one(tmp_path, monkeypatch, open_page):
    folder = tmp_path / "study"
    make_study(folder, monkeypatch, tasks="PickXtimes", episodes="5", settings="contextual",
               delivery="turns", practice=0, checks=0, people=1)  # fmt: skip
    with Serving(folder) as server, open_page(server.url) as page:
        page.check("#agreed")
        page.click("text=Begin")
        heard = []
        page.wait_for_selector("h1:has-text('Listen')")
        while page.query_selector("h1:has-text('Listen')"):
            heard.append(page.inner_text(".said"))
            page.keyboard.press("Enter")
        page.wait_for_selector(".asks")
        heard.append(page.inner_text(".said"))
        job = server.session.study.questions(0)[0].job
        said = server.session._items[words_of(job)].turns
        assert len(said) > 2
        assert heard == [f"“{text}”" for text in said]


def test_the_page_is_labeled_and_follows_the_color_scheme(tmp_path, monkeypatch, open_page):
    folder = tmp_path / "study"
    make_study(folder, monkeypatch, tasks="VideoUnmask", episodes="1", people=1, checks=0)
    colors = set()
    with Serving(folder) as server:
        for scheme in ("light", "dark"):
            with open_page(server.url, color_scheme=scheme, viewport=NARROW) as page:
                page.wait_for_selector("#agreed")
                colors.add(page.evaluate("() => getComputedStyle(document.body).backgroundColor"))
                if scheme == "dark":
                    page.check("#agreed")
                    page.click("text=Begin")
                    page.click(".watch button.main:not([disabled])")
                    page.wait_for_selector(".asks")
                    assert page.get_by_role(
                        "button", name="container, 1 of 3 from the left"
                    ).count()
                # Nothing is wider than the phone.
                assert page.evaluate("() => document.documentElement.scrollWidth") <= 390
    assert len(colors) == 2

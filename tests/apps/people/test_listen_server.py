"""The server of a study over real sockets: who is let in, what is sent, what is stored."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from study_fakes import Serving, all_answers, answer_all, draw_things, make_study, things_of

from roboirg.apps.people.answer_form import answer_of, goal_of
from roboirg.apps.people.listener_answers import (
    ANSWERS_FILE,
    AnswerLog,
    PersonJoined,
    read_events,
    standing_answers,
)
from roboirg.apps.people.listening_session import ListeningSession, OutOfDateError
from roboirg.apps.people.listening_study import words_of
from roboirg.apps.people.people_run import answered_plan
from roboirg.apps.people.question_view import view_question
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.grounding_items.grounding_item import read_items
from roboirg.evaluation.grounding_items.item_builder import EpisodeMedia
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.language.settings import setting_names
from roboirg.shortcuts.command_chance import is_right
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits.splits import get_episode

TASKS = "PickXtimes,StopCube,VideoUnmask,ButtonUnmask"


@pytest.fixture
def study(tmp_path, monkeypatch):
    make_study(tmp_path / "study", monkeypatch, tasks=TASKS, episodes="2")
    return tmp_path / "study"


@pytest.fixture
def served(study):
    with Serving(study) as server:
        yield server


class Client:
    """A browser without a page: keeps the cookie, tells who it is."""

    def __init__(self, server, *, cookie=None, **headers):
        self.port, self.cookie = server.port, cookie or f"{server.cookie}={server.key}"
        self.headers, self.code = headers, ""

    def ask(self, path, body=None):
        data = (
            None if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
        )
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", data)
        headers = {"Cookie": self.cookie, "X-Person": self.code, **self.headers}
        for name, value in headers.items():
            request.add_header(name, value)
        try:
            answer = urllib.request.urlopen(request, timeout=300)  # noqa: S310 - our own server
        except urllib.error.HTTPError as error:
            answer = error
        with answer:
            return answer.status, answer.headers, answer.read()

    def read(self, path, body=None):
        status, _, content = self.ask(path, body)
        assert status == 200, content
        return json.loads(content)

    def join(self):
        self.code = self.read("/join", {"consent": True})["code"]
        return self


def right(question, things):
    episode = get_episode(question.job.task, question.job.split, question.job.episode)
    return answer_of(episode, episode.goal)


def first_answer(state):
    """Return an answer that fills the form: the first thing of each kind, the first values."""
    nouns = [one["noun"] for one in state["things"]]
    return {
        "number": state["number"],
        "objects": [nouns.index(noun) for noun in state["points"][: state["least"]]],
        "values": {one["name"]: one["values"][0] for one in state["fields"]},
        "seconds": 2.5,
    }


def test_only_browsers_with_the_key_are_answered(served, study):
    port, me = served.port, Client(served)
    assert me.ask("/")[0] == 200
    refused = [
        Client(served, cookie="other=1").ask("/"),
        Client(served, cookie=f"{served.cookie}=wrong").ask("/state"),
        Client(served, cookie="x").ask("/join", {"consent": True}),
        Client(served, cookie="x").ask(f"/?key={served.key}x"),
        Client(served, Host="evil.example").ask(f"/?key={served.key}"),
        Client(served, Host=f"evil.example:{port}").ask("/join", {"consent": True}),
        Client(served, Origin="http://evil.example").ask("/join", {"consent": True}),
    ]
    assert {status for status, _, _ in refused} == {403}
    assert not any(served.key in f"{headers}{text}" for _, headers, text in refused)
    assert read_events(study) == []
    assert Client(served, Origin=f"http://127.0.0.1:{port}").ask("/join", {})[0] == 400
    assert Client(served, Origin=f"https://127.0.0.1:{port}").ask("/join", {})[0] == 400
    _, headers, _ = me.ask("/")
    assert "connect-src 'self'" in headers["Content-Security-Policy"]
    assert headers["Cache-Control"] == "no-store"
    assert (study / "key").stat().st_mode & 0o077 == 0


def test_requests_that_make_no_sense_are_refused(served, study):
    me = Client(served)
    assert me.ask("/join", {})[0] == 400
    assert me.ask("/join", b"[1]")[0] == 400
    assert me.ask("/join", b"{")[0] == 400
    assert me.ask("/join", b"[" * 100_000)[0] == 413
    assert me.ask("/state")[0] == 400
    assert me.ask("/elsewhere")[0] == me.ask("/elsewhere", {"number": 1})[0] == 404
    for path in (
        "/media/../study.json",
        "/media/pictures/..%2f..%2fstudy.json",
        "/media/pictures/0123456789abcdef01234567.png",
        "/study.json",
        "/questions/items.jsonl",
    ):
        assert me.ask(path)[0] == 404
    me.join()
    state = me.read("/state")
    good = first_answer(state)
    for change in ({"number": 2}, {"number": 0}, {"number": 99}):
        assert me.ask("/answer", {**good, **change})[0] == 409
    for change in ({"number": "1"}, {"objects": [99]}, {"objects": [-1]}, {"objects": [0.0]},
                   {"objects": None}, {"objects": []}, {"values": {}}, {"values": None},
                   {"values": {"repeats": {}}}):  # fmt: skip
        assert me.ask("/answer", {**good, **change})[0] == 400
    assert me.ask("/undo", {"number": 1})[0] == 409
    assert len(read_events(study)) == 1
    assert me.read("/answer", {**good, "seconds": "soon", "plays": -3, "hidden_s": True})
    stored = read_events(study)[-1]
    assert (stored.seconds, stored.plays, stored.hidden_s) == (0.0, 0, 0.0)


def test_people_get_codes_and_places_until_the_study_is_full(served, study):
    people = [Client(served).join() for _ in range(5)]
    assert len({one.code for one in people}) == 5
    status, _, text = Client(served).ask("/join", {"consent": True})
    assert (status, text) == (400, b"This study has all the people it needs. Thank you!\n")
    assert [one.person for one in read_events(study)] == [1, 2, 3, 4, 5]
    assert {one.consent for one in read_events(study)} != {""}


def test_more_people_can_be_let_in_than_were_planned(study):
    with Serving(study, people=7) as server:
        people = [Client(server).join() for _ in range(7)]
        assert Client(server).ask("/join", {"consent": True})[0] == 400
        assert people[6].read("/state")["total"] == 4  # practice


def test_people_who_join_at_once_get_different_places(served, study):
    threads = [threading.Thread(target=Client(served).join) for _ in range(5)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert sorted(one.person for one in read_events(study)) == [1, 2, 3, 4, 5]


def test_an_answer_is_stored_once_and_can_be_taken_back(served, study):
    me = Client(served).join()
    for _ in range(4):
        told = me.read("/answer", first_answer(me.read("/state")))
        assert set(told) == {"right", "objects", "values"}
    state = me.read("/state")
    assert (state["practice"], state["place"], state["total"], state["undo"]) == (
        False,
        1,
        10,
        False,
    )
    good = first_answer(state)
    assert me.read("/answer", good) == {}
    # Sent again, because the reply got lost.
    assert me.read("/answer", good) == {}
    assert len(read_events(study)) == 6
    other = {one["name"]: one["values"][1] for one in state["fields"]}
    changed = {"values": other} if other else {"objects": [1]}
    assert me.ask("/answer", {**good, **changed})[0] == 409
    after = me.read("/state")
    assert after["undo"]
    assert me.ask("/undo", {"number": 4})[0] == 409
    assert me.read("/undo", {"number": after["number"]}) == {}
    assert me.read("/state") == state
    assert me.ask("/undo", {"number": state["number"]})[0] == 409  # practice stays
    assert len(list(standing_answers(read_events(study)))) == 4


def test_a_new_server_goes_on_where_the_last_one_was(study):
    with Serving(study) as server:
        me = Client(server).join()
        for _ in range(6):
            me.read("/answer", first_answer(me.read("/state")))
        state, key = me.read("/state"), server.key
        with pytest.raises(StoreError, match="is being written"):
            ListeningSession(study)
    with Serving(study) as server:
        again = Client(server)
        again.code = me.code
        assert again.read("/state") == state
        assert server.key == key


def test_a_study_without_pictures_is_not_served(study):
    (study / "questions" / "items.jsonl").unlink()
    with pytest.raises(InvalidValueError, match="run roboirg listen plan again"):
        ListeningSession(study)


def test_a_torn_line_is_put_aside(study):
    with contextlib.closing(AnswerLog(study)) as log:
        log.append(PersonJoined(person=1, code="abc", consent="c", at="now"))
    path = study / ANSWERS_FILE
    whole = path.read_bytes()
    path.write_bytes(whole + b'{"event":"answered","person":1,"num')
    assert len(read_events(study)) == 1
    with contextlib.closing(AnswerLog(study)) as log:
        assert [one.code for one in log.events] == ["abc"]
        log.append(PersonJoined(person=2, code="def", consent="c", at="now"))
    assert len(read_events(study)) == 2
    assert (study / "answers.torn").read_bytes().startswith(b'{"event":"answered"')
    path.write_bytes(whole + b'{"event":"left"}\n')
    with pytest.raises(StoreError, match=r"answers.jsonl, line 2: not an answer of a study"):
        read_events(study)


KILLED = """
import os, signal, sys
from pathlib import Path
from roboirg.apps.people.listener_answers import AnswerLog, PersonJoined
log = AnswerLog(Path(sys.argv[1]))
for number in range(1, 100):
    log.append(PersonJoined(person=number, code=str(number), consent="", at=""))
    if number == 37:
        os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_was_stored_before_a_kill_is_there(tmp_path):
    done = subprocess.run([sys.executable, "-c", KILLED, tmp_path], check=False, env=os.environ)
    assert done.returncode == -signal.SIGKILL
    assert [one.person for one in read_events(tmp_path)] == list(range(1, 38))


def every_view(folder, monkeypatch):
    """Yield each question of a study of all tasks, with what its page is made of."""
    study = make_study(folder, monkeypatch, tasks=",".join(every_task()), episodes="3", people=5)
    items = {(one.task, one.split, one.episode, one.options): one
             for one in read_items(folder / "questions")}  # fmt: skip
    for place in range(5):
        for question in study.questions(place):
            job = question.job
            episode = get_episode(job.task, job.split, job.episode)
            _, objects = draw_things(episode)
            media = EpisodeMedia("a.png", None, (), 0, (), 0.5, objects)
            yield job, episode, items[words_of(job)], media


def test_what_is_sent_depends_on_words_and_pictures_alone(tmp_path, monkeypatch):
    seen = 0
    for job, episode, item, media in every_view(tmp_path / "study", monkeypatch):
        view = view_question(job, episode, item, media)
        # Another goal, another name of the setting, another order of what is known: the same page.
        hidden = msgspec.structs.replace(
            item, answer="", answers=[], goals=[], choice="", choice_answers=[], points=[],
            choices=[], hidden_slots=[], pattern=None, setting="", difficulty="", id="",
        )  # fmt: skip
        turned = media._replace(objects=dict(reversed(media.objects.items())))
        for goal in get_task(job.task).goals(episode.scene):
            other = replace(episode, goal=goal, seed=episode.seed + 1)
            assert view_question(job, other, hidden, turned) == view
            seen += 1
    assert seen > 1000


def test_nothing_privileged_is_sent_before_the_answer(served, study, monkeypatch):
    session = served.session
    for place in range(2):
        me = Client(served).join()
        for question in session.study.questions(place):
            job = question.job
            episode = get_episode(job.task, job.split, job.episode)
            state = me.read("/state")
            assert set(state) == {
                "state", "code", "number", "practice", "place", "total", "undo", "turns", "picture",
                "video", "points", "least", "things", "fields",
            }  # fmt: skip
            assert "check" not in json.dumps(state)
            words = json.dumps({**state, "turns": []}).lower()
            told = [job.task, job.split, episode.key, str(episode.seed), episode.difficulty,
                    *setting_names(), *(one.name for one in episode.scene.objects)]  # fmt: skip
            assert [one for one in told if one.lower() in words] == []
            me.read("/answer", first_answer(state))
    _, headers, page = me.ask("/")
    text = re.sub("<style.*?</style>", "", f"{headers}{page.decode()}", flags=re.DOTALL).lower()
    assert [one for one in (*every_task(), *setting_names()) if one.lower() in text] == []


def test_in_turns_one_utterance_after_the_other_is_shown(tmp_path, monkeypatch):
    make_study(tmp_path / "s", monkeypatch, tasks="PickXtimes", episodes="5", delivery="turns",
               settings="contextual", practice=0, checks=0, people=1)  # fmt: skip
    with Serving(tmp_path / "s") as server:
        state = Client(server).join().read("/state")
        assert len(state["turns"]) > 2


def test_random_answers_are_right_as_often_as_chance(tmp_path, monkeypatch):
    folder = tmp_path / "study"
    make_study(folder, monkeypatch, tasks=TASKS, episodes="10", people=10, practice=0, checks=0)
    rng, expected, variance = np.random.default_rng(5), 0.0, 0.0

    def choose(question, things):
        nonlocal expected, variance
        episode = get_episode(question.job.task, question.job.split, question.job.episode)
        every = all_answers(episode, things)
        goals = [goal_of(episode, one) for one in every]
        share = sum(goal is not None and is_right(goal, episode) for goal in goals) / len(every)
        expected, variance = expected + share, variance + share * (1 - share)
        return every[int(rng.integers(len(every)))]

    session = ListeningSession(folder)
    for _ in range(10):
        answer_all(session, choose)
    session.close()
    answers = list(standing_answers(read_events(folder)))
    assert len(answers) == 400
    won = 0
    for one in answers:
        episode = get_episode(one.task, one.split, one.episode)
        goals = {g for g in get_task(one.task).goals(episode.scene) if is_right(g, episode)}
        won += one.goal is not None and json.loads(one.goal) in [
            json.loads(_slots(one.task, goal)) for goal in goals
        ]
    assert abs(won - expected) < 4 * variance**0.5
    assert 0.05 < expected / 400 < 0.25
    assert len(answered_plan(folder).jobs()) == 400


def _slots(task, goal):
    from roboirg.policies.vlm.goal_schema import goal_schema

    return goal_schema(task).answers[goal]


def test_only_what_was_answered_is_played(study):
    with pytest.raises(InvalidValueError, match="answered yet"):
        answered_plan(study)
    session = ListeningSession(study)
    code = session.join()
    questions = session.study.questions(0)
    for number in range(1, 8):
        things = things_of(session, questions[number - 1])
        objects, values = right(questions[number - 1], things)
        body = {"objects": [things.index(one) for one in objects], "values": values}
        session.answer(code, number, body)
    session.undo(code, 8)
    with pytest.raises(OutOfDateError):
        session.undo(code, 8)
    session.close()
    plan = answered_plan(study)
    items = [one.job for one in questions[4:6] if one.kind == "item"]
    assert sorted(job.slug for job in plan.jobs()) == sorted(job.slug for job in items)
    assert plan.specs == {"people": f"people:{study}"}

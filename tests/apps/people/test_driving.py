"""People as policies: commands, what is sent, an episode driven in a real browser, its record."""

import json
import os
import threading
import urllib.error
import urllib.request

import numpy as np
import pytest
import sapien

from roboirg import main as cli
from roboirg.apps.people.drive_server import DriveServer
from roboirg.apps.people.driving_policy import CARRY, LOWEST, DrivingPolicy
from roboirg.apps.people.driving_session import DrivingSession, DrivingStoppedError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.observations import CAMERAS
from roboirg.evaluation.records.record import Job
from roboirg.evaluation.records.store import read_records
from roboirg.language.settings import setting_names
from roboirg.simulation.rendering.viewpoint import FOCAL_LENGTH, SIZE, to_front_camera
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode

TASK, EPISODE = "PickXtimes", 1
"""An easy one: a green cube, once on the target, then the button."""
JOB = Job(
    policy="person",
    task=TASK,
    split="test",
    episode=EPISODE,
    options=InstructionOptions("contextual"),
)


def pixel_of(name):
    """Return the pixel of the front picture that shows the top of an object."""
    one = get_episode(TASK, "test", EPISODE).scene[name]
    top = 0.04 if one.kind == "cube" else 0.005
    matrix = to_front_camera(sapien.Pose(p=[one.position.x, one.position.y, top]))
    x, y, z = matrix[:3, 3]
    return SIZE / 2 + FOCAL_LENGTH * x / z, SIZE / 2 + FOCAL_LENGTH * y / z


class Reachable(DrivingPolicy):
    """Takes every pose as reachable: there is no arm."""

    def _check_reach(self, row):
        if abs(row[1]) > 1:
            raise AssertionError(row)


def observation():
    pixels = np.zeros((256, 256, 3), np.uint8)
    return {
        "end_effector": np.array([-0.1, 0.0, 0.5, np.pi, 0.0, 0.0]),
        **{f"{camera}_rgb": pixels for camera in CAMERAS},
        "front_depth": np.full((256, 256, 1), 500, np.int16),
        "front_intrinsic": np.array([[128, 0, 128], [0, 128, 128], [0, 0, 1.0]]),
        "front_extrinsic": np.hstack([np.eye(3), np.zeros((3, 1))]).astype(np.float32),
    }


def commanded(*commands):
    """Return the rows of each command, or the message why nothing moved."""
    session = DrivingSession()
    policy, found = Reachable(session), []
    for one in commands:
        told = []
        session.tell = lambda told=told, **shown: told.append(shown)
        queue = [one]

        def take(queue=queue):
            if not queue:
                raise DrivingStoppedError
            return queue.pop()

        session.wait_command = take
        try:
            found.append(policy.act(observation()))
        except DrivingStoppedError:
            found.append(next(shown["message"] for shown in told if "message" in shown))
    return found


def test_commands_become_way_points():
    up, turn, down, point, close, wait = commanded(
        {"move": [0, 0.05, -0.05]}, {"turn": 0.5}, {"height": 0}, {"point": [128, 127.9]},
        {"grip": "close"}, {"wait": 0.5},
    )  # fmt: skip
    assert np.allclose(up, [[-0.1, 0.05, 0.45, np.pi, 0, 0, 0]])
    assert np.allclose(turn, [[-0.1, 0.05, 0.45, np.pi, 0, 0.5, 0]])
    assert np.allclose(down[0, 2], LOWEST)
    assert np.allclose(point[0, :3], [0.5 * 0.5 / 128, -0.5 * 0.5 / 128, CARRY])
    assert np.allclose(close[0, 6], -1)
    assert wait.shape == (10, 7)
    assert (wait[:, 6] == 0).all()


def test_commands_that_are_none_move_nothing():
    wrong = (
        {}, {"jump": 1}, {"move": [0, 0]}, {"move": [0, 0, 9]}, {"move": ["a", 0, 0]},
        {"turn": None}, {"turn": float("nan")}, {"grip": "squeeze"}, {"wait": 1e9},
        {"point": [0, 1000]}, {"point": [True, 0]}, {"height": -1},
    )  # fmt: skip
    assert all(str(one).startswith("Nothing moved: ") for one in commanded(*wrong))


def ask(server, path, body=None, *, cookie=True):
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(f"http://127.0.0.1:{server.port}{path}", data)
    if cookie:
        request.add_header("Cookie", f"{server.cookie}={server.key}")
    try:
        answer = urllib.request.urlopen(request, timeout=300)  # noqa: S310 - our own server
    except urllib.error.HTTPError as error:
        answer = error
    with answer:
        return answer.status, answer.read()


@pytest.fixture
def served(tmp_path):
    server = DriveServer(JOB, tmp_path / "driven")
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server
    server.shutdown()
    server.server_close()


def test_only_the_page_with_the_key_commands(served):
    assert ask(served, "/", cookie=False)[0] == 403
    assert ask(served, "/begin", {}, cookie=False)[0] == 403
    assert ask(served, "/command", {"turn": 1})[0] == 409
    assert ask(served, "/picture/front/1")[0] == ask(served, "/video.mp4")[0] == 404
    assert ask(served, "/picture/../key")[0] == ask(served, "/elsewhere", {})[0] == 404
    status, page = ask(served, "/")
    assert status == 200
    assert not [one for one in (*every_task(), *setting_names()) if one in page.decode()
                and one not in ("direct",)]  # fmt: skip
    assert json.loads(ask(served, "/news?after=-1")[1])["phase"] == "idle"


def drive(page, wait_s):
    """Drive the episode to its end as a person would."""
    limit = 1000 * wait_s

    def rest():
        page.wait_for_selector(".cockpit:not(.moving), #verdict", timeout=limit)

    def point(name):
        x, y = pixel_of(name)
        box = page.locator(".front").bounding_box()
        scale = box["width"] / SIZE
        # A busy page may never show that it moves; a command given meanwhile waits its turn.
        page.mouse.click(box["x"] + x * scale, box["y"] + y * scale)

    def height(text):
        # Commands are taken one by one: the height tells that the last one was.
        page.wait_for_selector(f".hand output:text-is('{text}')", timeout=limit)
        rest()

    def press(key, text=None):
        page.keyboard.press(key)
        if text:
            height(text)

    page.click("#begin")
    rest()
    point("cube_green")
    press("j", "2 cm")
    press(" ")
    page.wait_for_selector("#grip:has-text('Open')", timeout=limit)
    rest()
    page.click("text=To 20 cm")
    height("20 cm")
    point("target")
    press("j", "2 cm")
    page.click("#grip")
    page.wait_for_selector("#grip:has-text('Close')", timeout=limit)
    rest()
    press("l", "20 cm")
    press(" ")
    page.wait_for_selector("#grip:has-text('Open')", timeout=limit)
    rest()
    point("button")
    page.keyboard.press("j")
    page.wait_for_selector("#verdict", timeout=limit)


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.sim
def test_an_episode_is_driven_in_a_browser(served, open_page, wait_s, monkeypatch, capsys):
    sent = []
    with open_page(served.url) as page:
        page.on("response", lambda one: "/news" in one.url and sent.append(one.json()))
        drive(page, wait_s)
        text = page.inner_text("#verdict")
    assert "Success" in text
    assert "What was meant: " in text
    # Before the end nothing tells goal, setting or seed.
    episode = get_episode(TASK, "test", EPISODE)
    before = [one for one in sent if one["phase"] != "over"]
    assert len(before) > 10
    for one in before:
        assert one["verdict"] is None
        words = json.dumps({**one, "heard": []})
        for told in (TASK, "contextual", "green", str(episode.seed), "subgoal"):
            assert told not in words

    folder = served._folder
    (record,) = read_records(folder)
    assert (record.policy, record.outcome, record.privileged) == ("person", "success", False)
    assert record.timings["policy_act"] > 0
    monkeypatch.setattr("sys.argv", ["roboirg", "leaderboard", "verify", str(folder)])
    with pytest.raises(SystemExit) as left:
        cli.main()
    assert left.value.code in (0, None), capsys.readouterr()

    out = folder.parent / "demonstrations"
    plan = folder.parent / "driven.yaml"
    plan.write_text(f"demonstrations: {{policy: 'recorded:{folder}?policy=person'}}")
    words = ["export", "demonstrations", "--tasks", TASK, "--split", "test", "--episodes", "1-1",
             "--settings", "contextual", "--pictures", "none", "--workers", "0",
             "--plan", str(plan), "--out", str(out)]  # fmt: skip
    monkeypatch.setattr("sys.argv", ["roboirg", *words])
    with pytest.raises(SystemExit) as left:
        cli.main()
    assert left.value.code in (0, None), capsys.readouterr()
    assert json.loads((out / "meta/info.json").read_text())["total_episodes"] == 1


@pytest.mark.sim
def test_what_cannot_be_reached_moves_nothing_and_an_episode_can_begin_again(served):
    def news(phase, version=-1):
        while True:
            now = json.loads(ask(served, f"/news?after={version}")[1])
            if now["phase"] == phase:
                return now
            assert now["phase"] not in ("failed", "over"), now
            version = now["version"]

    assert ask(served, "/begin", {})[0] == 200
    news("driving")
    for _ in range(3):  # away from the arm, until it does not reach farther
        assert ask(served, "/command", {"move": [0.5, 0.5, 0]})[0] == 200
        now = news("driving")
    assert now["message"].startswith("Nothing moved: ")
    status, picture = ask(served, f"/picture/wrist/{now['pictures']}")
    assert (status, picture[:2]) == (200, b"\xff\xd8")
    assert ask(served, "/begin", {})[0] == 200
    assert news("driving")["steps"] == 0
    assert not os.path.exists(served._folder / "records.jsonl")  # noqa: PTH110 - no run, no file

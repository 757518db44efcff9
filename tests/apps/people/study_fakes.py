"""Studies with made-up pictures: every thing is a square, so no simulator is needed."""

import itertools
import threading
from collections import defaultdict
from fractions import Fraction

import numpy as np

from roboirg.apps.people.answer_form import FormAnswer, answer_form
from roboirg.apps.people.listen_server import ListenServer
from roboirg.apps.people.listening_session import QUESTIONS, ListeningSession
from roboirg.apps.people.listening_study import PEOPLE, ListeningStudy, write_listening_study
from roboirg.evaluation.grounding_items import question_set
from roboirg.evaluation.grounding_items.grounding_item import PointTarget, encode_mask, write_items
from roboirg.evaluation.grounding_items.item_builder import EpisodeMedia
from roboirg.evaluation.grounding_items.media_store import PICTURES, VIDEOS, store_content
from roboirg.evaluation.grounding_items.referents import find_candidates, find_referents
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.tasks import get_task
from roboirg.util.media import Clip, Picture, encode_mp4, encode_png

SIDE, STRIDE = 16, 40


def draw_things(episode):
    """Return a picture with a square for each thing, and where they are; by name, not by goal."""
    picture = np.full((256, 256, 3), 90, np.uint8)
    found = {}
    for number, one in enumerate(sorted(find_candidates(episode), key=lambda one: one.name)):
        row, column = divmod(number, 5)
        x, y = 30 + STRIDE * column, 60 + STRIDE * row
        mask = np.zeros((256, 256), bool)
        mask[y : y + SIDE, x : x + SIDE] = True
        picture[mask] = (200, 60, 40)
        center = {"x": x + SIDE // 2, "y": y + SIDE // 2}
        found[one.name] = PointTarget(
            kind=one.kind, picture="first", size=(256, 256), counts=encode_mask(mask), **center
        )
    return picture, found


def store_fake_media(folder, episode, every, most):
    picture, found = draw_things(episode)
    video, steps = None, 0
    if get_task(episode.task).name.startswith("Video"):
        clip = Clip(np.full((4, 256, 256, 3), 40, np.uint8), Fraction(20))
        video, steps = store_content(folder, VIDEOS, encode_mp4(clip), ".mp4"), 40
    return EpisodeMedia(
        picture=store_content(folder, PICTURES, encode_png(Picture(picture)), ".png"),
        video=video,
        frames=(),
        steps=steps,
        points=tuple(found[one.objects[0]] for one in find_referents(episode)),
        meters=0.5,
        objects=found,
    )


def make_study(folder, monkeypatch, *, people=5, **options):
    """Write a study with its pictures; return it."""
    chosen = {"practice": 1, "checks": 2, **options}
    own = {name: chosen.pop(name) for name in ("practice", "checks", "seed") if name in chosen}
    plan = make_plan([f"{PEOPLE}=oracle"], **chosen)
    plan = plan.model_copy(update={"policies": (PEOPLE,)})
    study = ListeningStudy(plan=plan, people=people, **own).checked()
    write_listening_study(study, folder)
    monkeypatch.setattr(question_set, "store_media", store_fake_media)
    items = question_set.collect_items(study.export_request(), folder / QUESTIONS, workers=0)
    write_items(items, folder / QUESTIONS)
    return study


def things_of(session, question):
    """Return the names of the things of a question, in the order of the page."""
    return session._view(question).things


class Serving:
    """Serves a study in this process; a context manager."""

    def __init__(self, folder, **options):
        self.server = ListenServer(folder, **options)

    def __enter__(self):
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        return self.server

    def __exit__(self, *error):
        self.server.shutdown()
        self.server.server_close()


def answer_all(session: ListeningSession, choose):
    """Let a person join and answer everything; `choose` returns the answer to a question."""
    code = session.join()
    place = session._people[code] - 1
    for number, question in enumerate(session.study.questions(place), start=1):
        things = things_of(session, question)
        objects, values = choose(question, things)
        body = {"objects": [things.index(one) for one in objects], "values": values, "seconds": 1.5}
        session.answer(code, number, body)
    return code


def all_answers(episode, seen):
    """Return every answer that fills the form; `seen` can be pointed at."""
    form = answer_form(episode.task)
    of_kind = defaultdict(list)
    for name in seen:
        of_kind[episode.scene[name].kind].append(name)
    pointings = [
        objects
        for length in range(form.least, len(form.kinds) + 1)
        for objects in itertools.product(*(of_kind[kind] for kind in form.kinds[:length]))
        if len(set(objects)) == length
    ]
    values = [
        dict(zip((field.name for field in form.fields), chosen, strict=True))
        for chosen in itertools.product(*(field.values for field in form.fields))
    ]
    return [FormAnswer(objects, chosen) for objects in pointings for chosen in values]

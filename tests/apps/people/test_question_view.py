"""What is drawn around things, and that real pictures show all that can be pointed at."""

import cv2
import numpy as np
import pytest

from roboirg.apps.people.answer_form import answer_form
from roboirg.apps.people.question_view import MARGIN, outlines
from roboirg.evaluation.grounding_items.grounding_item import decode_mask
from roboirg.evaluation.grounding_items.referents import find_candidates
from roboirg.evaluation.grounding_items.seen_scene import look_at_episode
from roboirg.tasks.splits.splits import get_episode


def polygon(text):
    return np.array([list(map(float, one.split(","))) for one in text.split()], np.float32)


def test_an_outline_goes_around_its_thing():
    mask = np.zeros((256, 256), bool)
    mask[100:120, 40:70] = True
    (found,) = outlines(mask)
    shape = polygon(found)
    for y, x in np.argwhere(mask):
        assert cv2.pointPolygonTest(shape, (float(x) + 0.5, float(y) + 0.5), measureDist=False) > 0
    assert shape.min(axis=0).tolist() == [40.5 - MARGIN, 100.5 - MARGIN]
    assert shape.max(axis=0).tolist() == [69.5 + MARGIN, 119.5 + MARGIN]


def test_a_thing_in_two_parts_has_two_outlines_the_larger_first():
    mask = np.zeros((256, 256), bool)
    mask[10:14, 10:14] = mask[100:130, 100:130] = True
    first, second = map(polygon, outlines(mask))
    assert cv2.contourArea(first) > cv2.contourArea(second) > 0
    assert outlines(np.zeros((256, 256), bool)) == []


@pytest.mark.sim
@pytest.mark.parametrize("task", ["PickXtimes", "ButtonUnmask", "VideoUnmask", "PutInBox"])
def test_everything_that_can_be_pointed_at_is_seen(task):
    episode = get_episode(task, "test", 30)
    seen = look_at_episode(episode, every=40).objects
    kinds = answer_form(task).kinds
    wanted = [one.name for one in find_candidates(episode) if one.kind in kinds]
    assert len(wanted) > 1
    assert list(seen) == wanted
    for target in seen.values():
        mask = decode_mask(target.counts, target.size)
        assert mask[target.y, target.x]
        assert len(outlines(mask)) >= 1

"""Balanced draws: yes and no equally often among any four neighboring episodes."""

from __future__ import annotations

import itertools
from typing import NamedTuple

from roboirg.language.request import InstructionRequest
from roboirg.language.template_sampler import TemplateSampler
from roboirg.language.templates import DRAWS


class TwoBits(NamedTuple):
    """Two independent choices."""

    first: bool
    second: bool


_COMBINATIONS = tuple(itertools.starmap(TwoBits, itertools.product((True, False), repeat=2)))
BLOCK = len(_COMBINATIONS)


def draw_balanced(request: InstructionRequest, purpose: str) -> TwoBits:
    """Draw two bits for an episode; each block of four episodes has every combination once.

    With independent draws a split of fifty could favor the value named first by chance.
    """
    episode = request.episode
    block, place = divmod(episode.index, BLOCK)
    key = f"{DRAWS}|{episode.task}|{episode.split}|{block}"
    cycle = TemplateSampler(key).cycle(purpose, _COMBINATIONS)
    found = next(itertools.islice(cycle, place, None))
    request.sampler.log.append(f"{purpose}/{_COMBINATIONS.index(found)}")
    return found

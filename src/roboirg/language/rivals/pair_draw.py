"""The draw of a pair, and of the words that choose one of its values."""

from __future__ import annotations

import itertools
from typing import Literal, NamedTuple

from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.rivals import rival_templates as templates
from roboirg.language.rivals.balanced_rivals import balanced_rival
from roboirg.language.rivals.value_pair import ValuePair, rival_pairs
from roboirg.language.template_sampler import sampler_for

Fill = Literal["other", "both"]


class PairOrder(NamedTuple):
    """Whether the value that is meant is introduced first, and whether the remark points at it."""

    meant_first: bool
    points_at_meant: bool


_ORDERS = tuple(itertools.starmap(PairOrder, itertools.product((True, False), repeat=2)))
BLOCK = len(_ORDERS)


class PairDraw(NamedTuple):
    """A pair, and how the words choose one of its values.

    Attributes:
        pair: the values.
        meant_first: whether the meant one is introduced first.
        kind: kind of the remark that chooses.
        text: its template.
        fill: of a template with two fields: whether both values are pointed at, or the one is
            *the other*.
        points_at_meant: if not both: whether the pointer is for the meant value.
        pointers: the words that point.
    """

    pair: ValuePair
    meant_first: bool
    kind: templates.ReferenceKind
    text: str
    fill: Fill
    points_at_meant: bool
    pointers: templates.Pointers

    @property
    def introduced(self) -> tuple[GoalValue, GoalValue]:
        """The values in the order of the introduction."""
        meant, rival = self.pair
        return (meant, rival) if self.meant_first else (rival, meant)


def draw_pair(request: InstructionRequest) -> PairDraw:
    """Draw a slot, its rival, and the words that choose."""
    pairs = rival_pairs(request)
    slot = pairs[0].slot
    pair = balanced_rival(request, pairs)
    order = draw_order(request)
    kind, text, fill = _remark(request, points_at_meant=order.points_at_meant)
    if slot not in COLOR_SLOTS:
        fill = "both"  # "The former, not the other number" is hard to hear
    pointers: tuple[templates.Pointers, ...] = (templates.RANKS,)
    if slot in COLOR_SLOTS:
        pointers = (templates.RANKS, templates.ORDER)
        if kind in ("alone", "set aside"):  # next to another they are too long
            pointers += templates.MENTIONED.of(request.pool)
    return PairDraw(
        pair,
        order.meant_first,
        kind,
        text,
        fill,
        order.points_at_meant,
        request.sampler.pick("rival pointers", pointers),
    )


def draw_order(request: InstructionRequest) -> PairOrder:
    """Draw the order for an episode; each block of four episodes has every one once.

    With independent draws a split of fifty could favor the value named first by chance.
    """
    episode = request.episode
    block, place = divmod(episode.index, BLOCK)
    key = f"{episode.task}|{episode.split}|{block}"
    cycle = sampler_for(key, request.options.language).cycle("rival order", _ORDERS)
    found = next(itertools.islice(cycle, place, None))
    request.sampler.log.append(f"rival order/{_ORDERS.index(found)}")
    return found


def _remark(
    request: InstructionRequest, *, points_at_meant: bool
) -> tuple[templates.ReferenceKind, str, Fill]:
    """Draw a remark; alone it has one pointer, and the others have two fields."""
    kind = request.sampler.pick("rival reference", ("alone", *templates.CHOICES))
    if kind == "alone":
        name: templates.ReferenceKind = "alone" if points_at_meant else "set aside"
        options = templates.SINGLED if points_at_meant else templates.SET_ASIDE
        return name, request.pick(f"{name} remark", options), "other"
    meant_first, meant_last = templates.CHOICES[kind]
    fill: Fill = request.sampler.pick("rival fill", ("other", "both"))
    # "The other one" follows what it is other than; the first pointer is right half of the time.
    chosen = meant_first if points_at_meant else meant_last
    return kind, request.pick(f"{kind} remark", chosen), fill

"""The kinds of memory: what each may use, and what none of them may."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from roboirg.apps.learning.policy.body_net import TOOL_NUMBERS, BodyNet, EpisodeBatch  # noqa: E402
from roboirg.apps.learning.policy.memories import MEMORIES  # noqa: E402
from roboirg.apps.learning.policy.policy_plan import MEMORY_NAMES  # noqa: E402

CLASSES, PARTS, THINGS, LOOKS = 3, 4, 5, 12
AT_THINGS = (True, False, True)
REMEMBERS = sorted(set(MEMORIES) - {"none"})


def batch_of(seed, decisions=(3, 7)):
    rng = np.random.default_rng(seed)
    shape = (1, LOOKS, THINGS)

    def numbers(*extra):
        return torch.from_numpy(rng.normal(0, 0.2, (*shape, *extra)).astype(np.float32))

    return EpisodeBatch(
        torch.from_numpy(rng.integers(0, CLASSES, shape)),
        numbers(2),
        numbers(2),
        torch.ones(shape, dtype=torch.bool),
        torch.ones(shape, dtype=torch.bool),
        torch.from_numpy(rng.normal(0, 1, (1, LOOKS, TOOL_NUMBERS)).astype(np.float32)),
        torch.ones((1, LOOKS), dtype=torch.bool),
        torch.ones((1, PARTS)),
        torch.tensor([list(decisions)]),
        torch.zeros((1, len(decisions)), dtype=torch.long),
        torch.zeros((1, len(decisions)), dtype=torch.long),
        torch.zeros((1, len(decisions)), dtype=torch.long),
    )


def body_of(memory):
    torch.manual_seed(0)
    return BodyNet(CLASSES, PARTS, AT_THINGS, memory).eval()


def changed(batch, looks):
    """Return a batch in which these looks show something else."""
    other = batch_of(99)
    places, tool = batch.places.clone(), batch.tool.clone()
    places[:, looks], tool[:, looks] = other.places[:, looks], other.tool[:, looks]
    return batch._replace(places=places, tool=tool)


def same(one, other):
    return all(torch.allclose(a, b, atol=1e-5) for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_no_memory_sees_the_future(memory):
    body, batch = body_of(memory), batch_of(1)
    assert same(body(batch), body(changed(batch, slice(8, None))))


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_the_present_counts(memory):
    body, batch = body_of(memory), batch_of(1)
    assert not same(body(batch), body(changed(batch, slice(7, 8))))


def test_without_memory_the_past_does_not_count():
    body, batch = body_of("none"), batch_of(1, (7,))
    assert same(body(batch), body(changed(batch, slice(0, 7))))


@pytest.mark.parametrize("memory", REMEMBERS)
def test_with_memory_the_past_counts(memory):
    body, batch = body_of(memory), batch_of(1, (7,))
    assert not same(body(batch), body(changed(batch, slice(0, 7))))


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_padding_changes_nothing(memory):
    """An episode answers the same next to a longer one with more things."""
    body, batch = body_of(memory), batch_of(1)
    short = batch._replace(
        **{
            name: getattr(batch, name)[:, :9]
            for name in ("classes", "places", "turns", "seen", "known", "tool", "there")
        }
    )
    there = batch.there.clone()
    there[:, 9:] = False
    assert same(body(batch._replace(there=there)), body(short))


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_what_is_unknown_is_never_chosen(memory):
    body, batch = body_of(memory), batch_of(1)
    seen, known = batch.seen.clone(), batch.known.clone()
    seen[:, :, 2], known[:, :, 2] = False, False
    things = body(batch._replace(seen=seen, known=known)).things
    assert (things.argmax(-1) != 2).all()


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_only_memory_chooses_what_is_out_of_sight(memory):
    body, batch = body_of(memory), batch_of(1)
    seen = batch.seen.clone()
    seen[:, 7, 2] = False
    things = body(batch._replace(seen=seen)).things
    can = bool((things[0, 1, :, 2] > -1e3).all())
    assert can == (memory == "recurrent")


def test_every_memory_can_be_named():
    assert sorted(MEMORIES) == sorted(MEMORY_NAMES)

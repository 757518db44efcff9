"""The kinds of memory: what each may use, and what none of them may."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from roboirg_learn.policy import body_net  # noqa: E402
from roboirg_learn.policy.body_net import (  # noqa: E402
    TOOL_NUMBERS,
    BodyNet,
    EpisodeBatch,
)
from roboirg_learn.policy.fast_weights import (  # noqa: E402
    FastNorm,
    FastWeights,
)
from roboirg_learn.policy.frame_memory import even_frames  # noqa: E402
from roboirg_learn.policy.memories import Decisions, MemoryCache  # noqa: E402
from roboirg_learn.policy.policy_data import LABELS, LookArrays  # noqa: E402
from roboirg_learn.policy.policy_plan import (  # noqa: E402
    HANDS,
    PLANNERS,
)
from roboirg_learn.policy.subgoal_net import SubgoalInputBatch  # noqa: E402

CLASSES = 3
PARTS = 4
THINGS = 5
LOOKS = 12
AT_THINGS = (True, False, True)
MEMORIES = sorted(set(body_net.MEMORIES) - {HANDS, *PLANNERS})


def batch_of(seed, decisions=(3, 7)):
    """Return one drawn episode of twelve looks, with decisions at some of them."""
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
        decisions_at(*decisions),
        **dict.fromkeys(LABELS, torch.zeros(len(decisions), dtype=torch.long)),
    )


def decisions_at(*looks):
    """Return decisions of one episode at these looks."""
    return Decisions(torch.zeros(len(looks), dtype=torch.long), torch.tensor(looks))


def body_of(memory):
    torch.manual_seed(0)
    return BodyNet(CLASSES, PARTS, AT_THINGS, memory).eval()


def with_changed_looks(batch, looks):
    """Return a batch in which these looks show something else."""
    other = batch_of(99)
    positions = batch.positions.clone()
    tool = batch.tool.clone()
    positions[:, looks], tool[:, looks] = other.positions[:, looks], other.tool[:, looks]
    return batch._replace(positions=positions, tool=tool)


def gives_same_answers(first, other):
    return all(torch.allclose(a, b, atol=1e-5) for a, b in zip(first[:5], other[:5], strict=True))


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_decisions_do_not_depend_on_later_looks(memory):
    """A policy decides at looks 3 and 7 of twelve; from look 8 on the pictures are exchanged.

    A look is what the policy sees at a moment. Both decisions lie before the change, so each kind
    of memory has to answer as before: a policy cannot see the future.
    """
    body = body_of(memory)
    batch = batch_of(seed=1, decisions=(3, 7))

    with_another_end = with_changed_looks(batch, slice(8, None))

    assert gives_same_answers(body(batch), body(with_another_end))


def first_looks_of(batch, looks, things):
    """Return the first looks of a batch, in which some things were not yet seen, and the last."""
    parts = [part[:, :looks, :things] for part in batch[:5]]
    return batch._replace(
        **dict(zip(batch._fields, parts, strict=False)),
        tool=batch.tool[:, :looks],
        has_look=batch.has_look[:, :looks],
        decisions=decisions_at(looks - 1),
    )


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_memory_carried_from_look_to_look_equals_reading_all_looks_at_once(memory):
    """An answer with what was carried from earlier looks equals one that reads all looks anew.

    An episode of 12 looks (pictures at some moments) is read up to 1, 4, 5, again 5, and 12 looks.
    There are objects 0 to 2 in it, and from the fifth look on also 3 and 4. What is carried from
    one time to the next is in a `MemoryCache`, into which only new looks are read.
    """
    body = body_of(memory)
    batch = batch_of(seed=1)
    batch.visible[:, :4, 3:] = False  # (episode, looks, objects)
    batch.confirmed[:, :4, 3:] = False
    carried = MemoryCache()

    for looks, objects in ((1, 3), (4, 3), (5, 5), (5, 5), (12, 5)):
        part = first_looks_of(batch, looks, objects)
        assert gives_same_answers(body(part, carried), body(part)), looks


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_only_a_body_with_memory_depends_on_earlier_looks(memory):
    """The decision is made at look 7: its own picture changes the answer of each kind.

    Other pictures at looks 0 to 6 change it as well, unless the kind of memory is *none*.
    """
    body = body_of(memory)
    batch = batch_of(1, (7,))

    assert not gives_same_answers(body(batch), body(with_changed_looks(batch, slice(7, 8))))
    assert gives_same_answers(body(batch), body(with_changed_looks(batch, slice(0, 7)))) == (
        memory == "none"
    )


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_padding_changes_nothing(memory):
    """An episode of nine looks answers the same if it is padded to the twelve of a longer one."""
    body = body_of(memory)
    padded = batch_of(1)
    padded.has_look[:, 9:] = False
    short = padded
    for name in (*LookArrays._fields, "has_look"):
        first_looks = getattr(padded, name)[:, :9]
        short = short._replace(**{name: first_looks})

    assert gives_same_answers(body(padded), body(short))


@pytest.mark.parametrize("memory", sorted(MEMORIES))
def test_an_object_that_was_never_seen_is_never_chosen(memory):
    """The objects are numbered; number 2 is unknown."""
    body = body_of(memory)
    batch = batch_of(1)
    seen = batch.visible.clone()
    known = batch.confirmed.clone()
    seen[:, :, 2] = False
    known[:, :, 2] = False

    things = body(batch._replace(visible=seen, confirmed=known)).tracks

    assert (things.argmax(-1) != 2).all()


def with_one_kept_look(batch):
    """Return a batch of one decision with what planners read: no context, and look 0 as kept."""
    nothing = torch.zeros((1, 0))
    kept_looks = torch.zeros((1, 1), dtype=torch.long)
    return batch._replace(subgoal_inputs=SubgoalInputBatch(nothing, kept_looks, nothing))


@pytest.mark.parametrize("memory", sorted(body_net.MEMORIES))
def test_any_memory_lets_the_same_objects_be_chosen_in_sight_or_not(memory):
    """Else a difference between memories could be one of what they may choose.

    Of objects 0 to 4, number 2 is not in sight at the decision, at look 7, and can be chosen all
    the same. Number 3 was never seen often enough to be no mistake (confirmed): whatever the move,
    it is chosen with probability 0.
    """
    body = body_of(memory)
    batch = with_one_kept_look(batch_of(seed=1, decisions=(7,)))
    batch.visible[:, 7, 2] = False  # (episode, look, object)
    batch.confirmed[:, :, 3] = False

    probabilities = body(batch).tracks.softmax(-1)  # (decision, move, object)

    can_be_chosen = (probabilities > 0).any(-2).flatten()
    assert can_be_chosen.tolist() == [True, True, True, False, True]


def test_tracks_of_padding_do_not_change_which_looks_a_planner_keeps():
    """An episode with objects 0 to 2 scores its recent looks as it does with two empty tracks."""
    body = body_of("keyframes")
    padded = with_one_kept_look(batch_of(seed=1, decisions=(11,)))
    padded.visible[:, :, 3:] = False  # (episode, look, object)
    padded.confirmed[:, :, 3:] = False

    short = first_looks_of(padded, LOOKS, things=3)

    assert torch.allclose(body(padded).keep_scores, body(short).keep_scores, atol=1e-5)


def fast_numbers(seed, tokens=3, size=2):
    torch.manual_seed(seed)
    fast = FastWeights(torch.randn(1, 1, size, size), torch.randn(1, 1, 1, size))
    norm = FastNorm(torch.randn(1, 1, size) * 0.3, torch.randn(1, 1, size) * 0.3)
    keys, values = torch.randn(2, 1, 1, tokens, size)
    return fast, norm, keys, values, torch.rand(1, 1, tokens, 1) * 0.1


def test_reading_fast_weights_gives_the_value_computed_by_hand():
    """Weights W = 2 I and biases b = (0, 1), read with the key k = (3, 4), give k + z / rms(z).

    z = W k + b = (6, 9), rms(z) = sqrt((36 + 81) / 2) = sqrt(58.5); the scale and shift of the norm
    are 0 here, which leaves z / rms(z) as it is.
    """
    fast = FastWeights(2 * torch.eye(2)[None, None], torch.tensor([[[[0.0, 1.0]]]]))
    norm = FastNorm(torch.zeros(1, 1, 2), torch.zeros(1, 1, 2))

    read = fast.read(torch.tensor([[[[3.0, 4.0]]]]), norm).flatten()

    assert torch.allclose(read, torch.tensor([6.0, 9.0]) / 58.5**0.5 + torch.tensor([3.0, 4.0]))


@pytest.mark.parametrize("seed", range(2))
def test_an_update_of_fast_weights_follows_the_gradient_of_its_loss(seed):
    """One update is one step of gradient descent, here computed by PyTorch's automatic gradient.

    The loss of three tokens is rate / 2 * |norm(W k + b) - (v - k)|², with drawn numbers; keys k,
    values v.
    """
    fast, norm, keys, values, rates = fast_numbers(seed)
    weights, biases = (weights.clone().requires_grad_() for weights in fast)
    error = norm(keys @ weights + biases) - (values - keys)
    (rates * error.square() / 2).sum().backward()

    after = fast.updated(keys, values, rates, norm)

    assert torch.allclose(after.weights, weights.detach() - weights.grad, atol=1e-5)
    assert torch.allclose(after.biases, biases.detach() - biases.grad, atol=1e-5)


def test_an_update_changes_fast_weights_by_a_norm_of_at_most_five():
    """Keys and rates a hundred times as large as usual would change the weights by far more."""
    fast, norm, keys, values, rates = fast_numbers(seed=0)

    updated = fast.updated(100 * keys, values, 100 * rates, norm)

    change = updated.weights - fast.weights
    assert float(change.norm()) == pytest.approx(5.0)


def frames_kept_at(look):
    """Return the numbers of the frames that are kept at a look; -1 fills the 32 places up."""
    return even_frames(torch.tensor([[look]]))[0, 0].tolist()


def test_up_to_32_frames_are_all_kept_and_of_more_32_evenly_spaced():
    """Looks count from 0: at look 5 there are six frames, at 31 as many as there are places.

    At look 620 the 32 frames from 0 to 620 are 620 / 31 = 20 apart.
    """
    assert frames_kept_at(5) == [0, 1, 2, 3, 4, 5] + [-1] * 26
    assert frames_kept_at(31) == list(range(32))
    assert frames_kept_at(620) == list(range(0, 621, 20))


@pytest.fixture
def modulated_and_plain():
    """A body with sampled frames, and one without memory but with the same other weights."""
    modulated = body_of("framesamp")
    plain = body_of("none")
    missing, unexpected = plain.load_state_dict(modulated.state_dict(), strict=False)
    assert not missing
    assert all(name.startswith("memory.") for name in unexpected)
    return modulated, plain


def are_equal(first, other):
    """Return whether two answers are equal bit for bit."""
    return all(map(torch.equal, first[:5], other[:5]))


def test_modulation_changes_the_answer_of_a_body(modulated_and_plain):
    """Two bodies have the same weights, but one is modulated by sampled frames; answers differ."""
    modulated, plain = modulated_and_plain

    assert not are_equal(modulated(batch_of(1)), plain(batch_of(1)))


def test_modulation_with_zero_weights_equals_a_body_without_memory(modulated_and_plain):
    """With weights 0 the frames scale by 1 and shift by 0, so nothing of them is left.

    The two bodies share all weights but those of the memory.
    """
    modulated, plain = modulated_and_plain
    for layer in modulated.memory.layers:
        torch.nn.init.zeros_(layer.scale_shift.weight)

    assert are_equal(modulated(batch_of(1)), plain(batch_of(1)))


def tokens_in_first_layer(body, batch):
    """Return the vectors that a body's first layer gets: the robot's, and those of the objects."""
    found = []
    body.encoder.layers[0].linear1.register_forward_hook(
        lambda layer, inputs, output: found.append(inputs[0])
    )
    body(batch)
    ((robot, *objects),) = found[0]
    return robot, torch.stack(objects)


def test_fast_weights_change_the_robot_s_token_and_no_object_s():
    """A policy decides at look 7. The pictures before it, looks 0 to 6, are exchanged.

    Only its memory knows of them. Fast weights (the memory "ttt") are added to the vector (token)
    of the robot alone, so that this one differs, and those of the objects are the same.
    """
    body = body_of("ttt")
    batch = batch_of(seed=1, decisions=(7,))
    other_past = with_changed_looks(batch, slice(0, 7))

    robot, objects = tokens_in_first_layer(body, batch)
    robot_with_other_past, objects_with_other_past = tokens_in_first_layer(body, other_past)

    assert not torch.allclose(robot, robot_with_other_past, atol=1e-4)
    assert torch.equal(objects, objects_with_other_past)

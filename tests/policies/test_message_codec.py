"""The bytes of messages: what is encoded is decoded, and hostile bytes are refused."""

import contextlib

import msgpack
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from roboirg.policies.remote.message_codec import CodecError, pack, unpack

ARRAYS = hnp.arrays(
    st.sampled_from(["|u1", "<f4", "<f8", ">i2", "|b1", "<i8", "<U3"]),
    hnp.array_shapes(min_dims=0, min_side=0, max_side=4),
)
PLAIN = st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.text() | st.binary()
MESSAGES = st.dictionaries(
    st.text(),
    st.recursive(
        PLAIN | ARRAYS,
        lambda held: st.lists(held, max_size=3) | st.dictionaries(st.text(), held, max_size=3),
        max_leaves=5,
    ),
    max_size=4,
)


def are_same(first, other):
    """Return whether two messages are equal, in types, in the order of keys and in arrays."""
    if isinstance(first, np.ndarray):
        return first.dtype == other.dtype and first.tobytes() == other.tobytes()
    if isinstance(first, dict):
        return list(first) == list(other) and all(are_same(first[key], other[key]) for key in first)
    if isinstance(first, list):
        return len(first) == len(other) and all(map(are_same, first, other))
    return type(first) is type(other) and first == other


@settings(max_examples=50)
@given(MESSAGES)
def test_any_message_is_decoded_as_it_was_encoded(message):
    assert are_same(unpack(pack(message)), message)


@settings(max_examples=50)
@given(st.binary(max_size=200) | MESSAGES.map(pack).map(lambda data: data[:-1]))
def test_any_bytes_are_a_message_or_refused(data):
    """Random bytes, and messages without their last byte: the result is a map, or a CodecError."""
    with contextlib.suppress(CodecError):
        assert isinstance(unpack(data), dict)


def test_decoded_arrays_keep_their_values_in_any_memory_order():
    """The array is stored by columns and read backward: 0 1 2 and 3 4 5 become 2 1 0, 5 4 3."""
    array = np.asfortranarray(np.arange(6).reshape(2, 3))[:, ::-1]

    found = unpack(pack({"x": array}))["x"]

    assert found.tolist() == [[2, 1, 0], [5, 4, 3]]


def test_decoded_arrays_are_read_only():
    found = unpack(pack({"x": np.zeros(3)}))["x"]

    with pytest.raises(ValueError, match="read-only"):
        found[0] = 1


@pytest.mark.parametrize("number", [np.float32(2.5), np.bool_(True), np.int8(-3)], ids=repr)
def test_numpy_scalars_keep_their_type(number):
    found = unpack(pack({"x": number}))["x"]

    assert found == number
    assert type(found) is type(number)


@pytest.mark.parametrize(
    "value",
    [
        np.array([object()]),
        np.zeros(2, np.complex64),
        np.zeros(2, "i4,i4"),
        np.complex128(1),
        {1, 2},
        2**80,
    ],
)
def test_objects_complex_numbers_and_sets_are_refused_by_the_encoder(value):
    """Also an array of records, and a whole number of more than 64 bits, 2^80."""
    with pytest.raises(CodecError, match="cannot be encoded"):
        pack({"x": value})


@pytest.mark.parametrize(
    ("data", "dtype", "shape", "words"),
    [
        (b"x" * 8, "|O", [1], "not accepted"),
        (b"x" * 8, "|V8", [1], "not accepted"),
        (b"x" * 8, "<c8", [1], "not accepted"),
        (b"x" * 8, "|u1", [2**62, 4], "has 8 bytes"),
        (b"x" * 8, "|u1", [3], "has 8 bytes"),
        (b"x" * 8, "|u1", {}, "has 8 bytes"),
        ("text", "|u1", [4], "is str, not bytes"),
        (None, "|u1", [4], "is NoneType, not bytes"),
    ],
)
def test_an_array_with_wrong_size_or_unsafe_type_is_refused_by_the_decoder(
    data, dtype, shape, words
):
    """A message has an array's bytes with its type and shape, which may be made up by a stranger.

    Objects (O), raw bytes (V8) and complex numbers (c8) are not accepted. Eight bytes are no array
    of 3 or of 2^64 numbers of one byte (u1). Bytes given as a text, or not at all, are none.
    """
    described = {b"__ndarray__": True, b"data": data, b"dtype": dtype, b"shape": shape}
    with pytest.raises(CodecError, match=words):
        unpack(msgpack.packb({"x": described}))


FLOATS = np.array([[0, 1, 2], [3, 4, 5]], np.float32)


@pytest.mark.parametrize(
    ("encoded", "decoded"),
    [
        (
            {"__ndarray__": True, "dtype": "<f4", "data": FLOATS.tobytes(), "shape": (2, 3)},
            FLOATS.tolist(),
        ),
        (
            {
                b"nd": True,
                b"type": "<f4",
                b"kind": b"",
                b"data": FLOATS.tobytes(),
                b"shape": (2, 3),
            },
            FLOATS.tolist(),
        ),
        (
            {b"nd": False, b"type": "<f4", b"data": b"\0\0\0\x3f"},
            0.5,
        ),
    ],
    ids=["keys of text", "array of msgpack-numpy", "number of msgpack-numpy"],
)
def test_arrays_encoded_by_other_packages_are_decoded(encoded, decoded):
    """Other packages name type and bytes of an array by other keys, of text or of bytes.

    FLOATS is [[0, 1, 2], [3, 4, 5]]. The four bytes 00 00 00 3F are 0.5 as a 32-bit float.
    """
    found = unpack(msgpack.packb({"x": encoded}))["x"]

    assert found.tolist() == decoded


def test_a_pickled_array_stays_encoded():
    """To unpickle bytes of a stranger would run their code."""
    pickled = {b"nd": True, b"type": "O", b"kind": b"O", b"data": b"x", b"shape": (1,)}

    assert unpack(msgpack.packb({"x": pickled}))["x"].keys() == pickled.keys()


def test_arrays_can_be_encoded_with_text_keys_for_servers_that_need_them():
    """Keys of an array are bytes otherwise; single numbers become plain numbers."""
    array = np.arange(6, dtype=np.float32).reshape(2, 3)
    data = pack({"x": array, "y": np.float32(0.5), "z": np.bool_(True)}, text_keys=True)
    assert msgpack.unpackb(data) == {
        "x": {"__ndarray__": True, "data": array.tobytes(), "dtype": "<f4", "shape": [2, 3]},
        "y": 0.5, "z": True,
    }  # fmt: skip


def test_a_list_nested_100000_times_is_refused():
    """91 begins a list of one element. The decoder must not run out of its stack."""
    with pytest.raises(CodecError):
        unpack(b"\x81\xa1x" + b"\x91" * 100_000 + b"\x00")

"""C3D files from their bytes: what the guide says, what Dexterit-E does, and damage."""

import contextlib
import struct

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from armimpedance.core.errors import InputError
from armimpedance.recordings.c3d.c3d_file import parse_c3d

RNG = np.random.default_rng(5)
POINTS = RNG.normal(size=(7, 2, 3)).astype(np.float32)
ANALOG = RNG.normal(size=(7, 3)).astype(np.float32)


def groups(c3d, **analog):
    return {
        "POINT": {"LABELS": c3d.texts("A", "Hand"), "SCALE": c3d.floats(-1.0, sizes=())},
        "ANALOG": {"LABELS": c3d.texts("u   ", "v   ", "w   ")} | analog,
    }


def places(read):
    return read.places(range(len(read.point_labels)))


def samples(read):
    return read.analog(range(len(read.analog_labels)))


def test_floats_and_labels(c3d):
    read = parse_c3d(c3d.write(POINTS, ANALOG, groups(c3d), rate=200.0), "a.c3d")
    assert (read.layout.frames, read.rate_hz, read.layout.samples_per_frame) == (7, 200.0, 1)
    np.testing.assert_array_equal(places(read), POINTS)
    np.testing.assert_array_equal(samples(read), ANALOG)
    assert read.point_labels == ("A", "Hand")
    assert read.analog_labels == ("u", "v", "w")


def test_scaled_integers_with_integer_offset(c3d):
    points = np.array([[[100, -200, 300]], [[1, 2, 3]]])
    analog = np.array([[10, 2048], [20, -2048]])
    parameters = {
        "POINT": {"SCALE": c3d.floats(0.1, sizes=())},
        "ANALOG": {
            "OFFSET": c3d.shorts(0, -48),
            "SCALE": c3d.floats(2.0, 4.0),
            "GEN_SCALE": c3d.floats(0.5, sizes=()),
        },
    }
    read = parse_c3d(c3d.write(points, analog, parameters, scale=0.1), "a.c3d")
    np.testing.assert_allclose(places(read), 0.1 * points, rtol=1e-6)
    np.testing.assert_allclose(samples(read), [[10, 4192], [20, -4000]], rtol=1e-6)


def test_unsigned_integers(c3d):
    parameters = {
        "POINT": {},
        "ANALOG": {"OFFSET": c3d.shorts(32768), "FORMAT": c3d.text("UNSIGNED")},
    }
    raw = np.array([[40000 - 65536], [32768 - 65536]])
    read = parse_c3d(c3d.write(np.zeros((2, 0, 3)), raw, parameters, scale=1.0), "a.c3d")
    assert samples(read)[:, 0].tolist() == [7232, 0]


def test_float_offset_of_dexterit_e(c3d):
    offset = {"OFFSET": c3d.floats(0.5, 0.0, -1.0)}
    read = parse_c3d(c3d.write(POINTS, ANALOG, groups(c3d, **offset)), "a.c3d")
    np.testing.assert_allclose(samples(read), ANALOG - np.array([0.5, 0.0, -1.0]), rtol=1e-6)


def test_data_start_zero_is_not_believed(c3d):
    parameters = groups(c3d)
    parameters["POINT"]["DATA_START"] = c3d.shorts(0, sizes=())
    read = parse_c3d(c3d.write(POINTS, ANALOG, parameters), "a.c3d")
    np.testing.assert_array_equal(places(read), POINTS)


def test_data_start_of_the_parameters_where_the_header_has_none(c3d):
    parameters = groups(c3d)
    parameters["POINT"]["DATA_START"] = c3d.shorts(3, sizes=())
    data = bytearray(c3d.write(POINTS, ANALOG, parameters))
    assert struct.unpack_from("<H", data, 16) == (3,)
    data[16:18] = b"\0\0"
    np.testing.assert_array_equal(places(parse_c3d(bytes(data), "a.c3d")), POINTS)


def test_texts_with_and_without_a_count(c3d):
    parameters = {
        "G": {
            "PLAIN": c3d.text("one text"),
            "MANY": c3d.texts("one", "two  "),
            "NONE": c3d.texts(),
            "N": c3d.shorts(4, sizes=()),
        }
    }
    read = parse_c3d(c3d.write(np.zeros((0, 0, 3)), np.zeros((0, 0)), parameters), "a.c3d")
    assert read.parameters.text("G", "PLAIN") == "one text"
    assert read.parameters.texts("G", "MANY") == ("one", "two")
    assert read.parameters.texts("G", "NONE") == ()
    assert read.parameters.number("G", "N") == 4.0
    assert read.parameters.number("G", "PLAIN") is None
    assert read.layout.frames == 0


def test_a_file_of_parameters_alone_needs_no_sound_header(c3d):
    data = bytearray(c3d.write(np.zeros((0, 0, 3)), np.zeros((0, 0)), {"G": {"N": c3d.shorts(4)}}))
    # last frame, scale, first block of the data, rate
    struct.pack_into("<H", data, 8, 500)
    struct.pack_into("<f", data, 12, 0.0)
    struct.pack_into("<H", data, 16, 4000)
    struct.pack_into("<f", data, 20, 0.0)
    read = parse_c3d(bytes(data), "common.c3d")
    assert read.layout.frames == 0
    assert read.parameters.number("G", "N") == 4.0


@pytest.mark.parametrize("frames", [65535, 65536, 70000, 140000])
@pytest.mark.parametrize("stays_at_limit", [False, True])
def test_more_frames_than_16_bits_hold(c3d, frames, stays_at_limit):
    analog = (1.0 + np.arange(frames)[:, None] % 1000).astype(np.float32)
    last = min(frames, 65535) if stays_at_limit else frames % 65536
    data = c3d.write(np.zeros((frames, 0, 3)), analog, {"POINT": {}}, last_frame=last)
    read = parse_c3d(data, "a.c3d")
    assert read.layout.frames == frames
    np.testing.assert_array_equal(samples(read), analog)


def test_several_samples_per_frame(c3d):
    analog = np.arange(12.0).reshape(6, 2)
    data = c3d.write(np.zeros((3, 1, 3)), analog, {"POINT": {}}, samples_per_frame=2)
    read = parse_c3d(data, "a.c3d")
    assert read.layout.frames == 3
    np.testing.assert_array_equal(samples(read), analog)


def test_more_labels_than_one_parameter_holds(c3d):
    parameters = {
        "ANALOG": {"LABELS": c3d.texts("a"), "LABELS2": c3d.texts("b")},
        "POINT": {},
    }
    read = parse_c3d(c3d.write(np.zeros((2, 0, 3)), np.ones((2, 3)), parameters), "a.c3d")
    assert read.analog_labels == ("a", "b", "ANALOG_3")


# ---- damage -------------------------------------------------------------------------------------


def refused(data: bytes) -> InputError:
    with pytest.raises(InputError) as caught:
        parse_c3d(data, "a.c3d")
    assert str(caught.value).startswith("a.c3d")
    assert "\n" not in str(caught.value)
    return caught.value


@pytest.mark.parametrize("data", [b"", b"\x02\x50", b"PK\x03\x04" * 300, b"\x00\x50" * 300])
def test_no_c3d_file(data):
    refused(data)


def test_other_processors(c3d):
    data = bytearray(c3d.write(POINTS, ANALOG, groups(c3d)))
    data[512 + 3] = 87
    assert "processor type 87" in refused(bytes(data)).problem


def test_header_claims_more_than_the_file_holds(c3d):
    data = c3d.write(POINTS, ANALOG, groups(c3d), last_frame=4000)
    assert "claims 4000 frames" in refused(data).problem


@pytest.mark.parametrize("block", [1, 400])
def test_data_outside_of_the_file(c3d, block):
    data = bytearray(c3d.write(POINTS, ANALOG, groups(c3d)))
    struct.pack_into("<H", data, 16, block)
    refused(bytes(data))


@pytest.mark.parametrize("offset", [1, 2, 3])
def test_parameters_that_loop(c3d, offset):
    data = bytearray(c3d.write(POINTS, ANALOG, groups(c3d)))
    name = data.index(b"LABELS")
    struct.pack_into("<H", data, name + 6, offset)
    read = parse_c3d(bytes(data), "a.c3d")
    assert read.point_labels == ("A", "Hand")
    np.testing.assert_array_equal(places(read), POINTS)


def test_parameters_that_run_past_the_end(c3d):
    data = bytearray(c3d.write(POINTS, ANALOG, groups(c3d)))
    sizes = data.index(b"LABELS") + 6 + 2 + 2
    data[sizes : sizes + 2] = b"\xff\xff"
    assert "past the end" in refused(bytes(data)).problem


def test_unknown_type_of_parameter(c3d):
    data = bytearray(c3d.write(POINTS, ANALOG, groups(c3d)))
    data[data.index(b"LABELS") + 6 + 2] = 9
    assert "type 9" in refused(bytes(data)).problem


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan")])
def test_no_rate(c3d, rate):
    assert "frames/s" in refused(c3d.write(POINTS, ANALOG, groups(c3d), rate=rate)).problem


def test_too_few_scales(c3d):
    scale = {"SCALE": c3d.floats(1.0)}
    with pytest.raises(InputError, match="SCALE"):
        samples(parse_c3d(c3d.write(POINTS, ANALOG, groups(c3d, **scale)), "a.c3d"))


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_truncation_raises_one_error(c3d, data):
    whole = c3d.write(POINTS, ANALOG, groups(c3d))
    length = data.draw(st.integers(0, len(whole) - 1))
    try:
        read = parse_c3d(whole[:length], "a.c3d")
    except InputError:
        return
    # Only the filling after the last frame may be lost without an error.
    np.testing.assert_array_equal(places(read), POINTS)
    np.testing.assert_array_equal(samples(read), ANALOG)


@settings(max_examples=300, deadline=None)
@given(changes=st.lists(st.tuples(st.integers(0, 1535), st.integers(0, 255)), max_size=6))
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_changed_bytes_raise_nothing_else(c3d, changes):
    data = bytearray(c3d.write(POINTS, ANALOG, groups(c3d, OFFSET=c3d.floats(0.0, 0.0, 0.0))))
    for at, value in changes:
        data[at % len(data)] = value
    with contextlib.suppress(InputError):
        read = parse_c3d(bytes(data), "a.c3d")
        assert places(read).shape == (read.layout.frames, len(read.point_labels), 3)
        assert len(samples(read)) == read.layout.frames * read.layout.samples_per_frame

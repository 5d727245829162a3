"""Streams: hostile packets, a closed pipe, the command."""

from __future__ import annotations

import contextlib
import io
import itertools
import json
import socket
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from made_up_arm import SUBJECT

from armimpedance.core.errors import InputError
from armimpedance.muscles.live import Live, packets_of, serve
from armimpedance.muscles.live.stream import LONGEST
from armimpedance.muscles.models import write_model
from manipulandum_sim.hand import IDEAL, simulate


def packet(k: int, **more) -> bytes:
    return json.dumps(
        {"time_s": k / 1000, "q_rad": [1.0, 1.5], "activation": [0.1] * 6} | more
    ).encode()


HOSTILE = [
    b"{",
    b"[1, 2]",
    b"null",
    b'"text"',
    b"\xff\xfe\x00",
    b"[" * 10_000,
    b'{"a":' * 2_000,
    b"1" * 10_000,
    b"x" * (LONGEST + 1),
    packet(1, q_rad=["1", "2"]),
    packet(1, q_rad=[1.0]),
    packet(1, q_rad=[1.0, 1e999]),
    packet(1, q_rad=[1.0, None]),
    packet(1, q_rad={"a": 1}),
    packet(1, activation=[0.1] * 7),
    packet(1, activation=[0.1] * 5 + [float("nan")]),
    packet(1, activation=[True] * 6),
    packet(1, activation="abcdef"),
    packet(1, activation=[[0.1]] * 6),
    packet(1, activation=None),
    packet(1, force_N=[1e30, 0]),
    packet(1, time_s="now"),
    packet(1, time_s=1e15),
    packet(1, time_s=10**400),
    packet(1, displacement_m=[0.1]),
    b'{"time_s": 0.001, "q_rad": [1.0, 1.5]}',
]


@pytest.mark.parametrize("hostile", HOSTILE, ids=range(len(HOSTILE)))
def test_a_hostile_packet_is_refused_in_one_line_and_the_stream_goes_on(model, hostile):
    written, told = [], []
    live = Live(model, SUBJECT)
    served = serve(live, [packet(0), hostile, packet(2)], _keep(written), told.append)
    assert (served.taken, served.refused) == (2, 1)
    assert len(told) == 1
    assert told[0].isprintable()
    assert len(told[0]) < 500
    assert [json.loads(line)["time_s"] for line in written] == [0.0, 0.002]


def _keep(lines: list[str]):
    def write(line: str) -> bool:
        lines.append(line)
        return True

    return write


def test_random_bytes_and_broken_packets_never_end_the_stream(model):
    rng = np.random.default_rng(4)
    packets = []
    for k in range(600):
        whole = bytearray(packet(k))
        for _ in range(rng.integers(0, 4)):
            whole[rng.integers(len(whole))] = rng.integers(256)
        packets.append(bytes(whole[: rng.integers(len(whole))] if k % 7 == 0 else whole))
    written, told = [], []
    served = serve(Live(model, SUBJECT), packets, _keep(written), told.append)
    assert served.taken + served.refused == sum(bool(p.strip()) for p in packets)
    assert served.taken > 100
    assert len(told) < 40
    for line in written:
        K = np.array(json.loads(line)["K_N_m"])
        assert np.linalg.eigvalsh(K)[0] > 0


def test_null_is_a_lost_channel_and_reset_begins_anew(model):
    written, told = [], []
    lost = packet(1, activation=[0.1] * 5 + [None])
    packets = [packet(0), lost, b'{"reset": true}', packet(0)]
    served = serve(Live(model, SUBJECT), packets, _keep(written), told.append)
    flags = [json.loads(line)["flags"] for line in written]
    assert [len(f) for f in flags] == [0, 1, 0]
    assert told == []
    assert served.flagged == 1


def test_lines_that_are_too_long_are_one_packet_each(model):
    text = b"a\n" + b"x" * (5 * LONGEST) + b"\n" + b"b\n" + b"y" * (LONGEST + 2)
    lines = list(packets_of(Live(model, SUBJECT), io.BytesIO(text)))
    assert [line[:1] for line in lines] == [b"a", b"x", b"b", b"y"]


@pytest.fixture
def call(model, tmp_path):
    write_model(model, tmp_path / "arm.json")
    (tmp_path / "recording.json").write_text(
        json.dumps(
            {
                "format": "armimpedance-recording",
                "version": 1,
                "kind": "hand",
                "sample_rate_hz": 1000,
                "subject": {"height_m": 1.75, "mass_kg": 70},
            }
        )
    )
    return [
        *(sys.executable, "-m", "armimpedance", "live"),
        *(str(tmp_path / "arm.json"), "--recording", str(tmp_path)),
    ]


@pytest.mark.study
def test_the_command_answers_each_line_and_ends_with_its_input(call, model):
    text = b"\n".join([packet(0), b"{", packet(1)])
    done = subprocess.run(call, input=text, capture_output=True)
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    once = Live(model, SUBJECT).update([0.1] * 6, q=[1.0, 1.5])
    np.testing.assert_allclose(lines[0]["K_N_m"], once.stiffness, rtol=1e-12)
    assert len(lines) == 2
    assert len(done.stderr.splitlines()) == 2


@pytest.mark.study
def test_a_closed_pipe_is_a_quiet_end(call):
    with subprocess.Popen(
        call, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        process.stdin.write(packet(0) + b"\n")
        process.stdin.flush()
        assert process.stdout.readline()
        process.stdout.close()
        # it ends on its own, though its input goes on
        for k in range(1, 20_000):
            try:
                process.stdin.write(packet(k) + b"\n")
                process.stdin.flush()
            except BrokenPipeError:
                break
        assert process.wait(20) == 0
        assert b"Traceback" not in process.stderr.read()
        process.stdin = None


@pytest.mark.study
def test_datagrams_are_answered_and_hostile_ones_passed_over(call):
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as theirs,
    ):
        ours.bind(("127.0.0.1", 0))
        ours.settimeout(20)
        theirs.bind(("127.0.0.1", 0))
        port = theirs.getsockname()[1]
        theirs.close()
        options = ["--udp", str(port), "--to", str(ours.getsockname()[1]), "--samples", "3"]
        with subprocess.Popen([*call, *options], stderr=subprocess.PIPE) as process:
            answer = None
            for k in range(200):  # until it listens
                ours.sendto(packet(k), ("127.0.0.1", port))
                ours.settimeout(0.1)
                with contextlib.suppress(TimeoutError, ConnectionRefusedError):
                    answer = json.loads(ours.recv(65_535))
                    break
            assert answer is not None
            stamped = [packet(j) for j in (k, k + 2, k + 1)]
            for hostile in (b"", b"{", b"x" * (LONGEST + 1), *stamped):
                ours.sendto(hostile, ("127.0.0.1", port))
            ours.sendto(packet(k + 3), ("127.0.0.1", port))
            ours.settimeout(20)
            stamps = [json.loads(ours.recv(65_535))["time_s"] for _ in range(2)]
            assert stamps == [(k + 2) / 1000, (k + 3) / 1000]
            assert process.wait(20) == 0
            # broken, too long, repeated, late; then the summary
            assert len(process.stderr.read().splitlines()) == 5


@pytest.mark.study
def test_a_recorded_session_goes_the_same_way(model):
    recording, _ = simulate(
        "cocontraction", seed=3, sets=1, conditions=["cocontraction_10"], servo=IDEAL
    )
    live = Live(model, recording, levels=recording)
    written, told = [], []
    first = recording.samples_of(0)
    packets = itertools.islice(packets_of(live, recording), first.stop + 1)
    served = serve(live, packets, _keep(written), told.append)
    assert told == []
    assert served.taken == first.stop
    last = json.loads(written[-1])
    other = Live(model, recording, levels=recording)
    for k in range(first.stop):
        one = other.update(
            recording.emg[k],
            q=recording.joint_angles[k],
            time_s=recording.time_s[k],
            force=recording.force[k],
        )
    assert last == one.to_dict()


def test_a_stream_of_the_laboratorys_network(model, monkeypatch):
    samples = [[1.0, 1.5, *[0.1] * 6], [1.0, 1.5, *[0.1] * 5, np.nan]]

    class Inlet:
        def __init__(self, stream):
            assert stream.channel_count() == 8

        def pull_sample(self):
            return samples.pop(0), float(2 - len(samples))

    def found(kind, name, timeout):
        return [SimpleNamespace(channel_count=lambda: 8 if name == "arm" else 6)]

    fake = SimpleNamespace(StreamInlet=Inlet, resolve_byprop=found)
    monkeypatch.setitem(sys.modules, "pylsl", fake)
    live = Live(model, SUBJECT)
    lines = [json.loads(p) for p in itertools.islice(packets_of(live, "lsl:arm"), 2)]
    assert lines[0] == {"time_s": 1.0, "q_rad": [1.0, 1.5], "activation": [0.1] * 6}
    assert lines[1]["activation"][-1] is None
    with pytest.raises(InputError, match="6 channels"):
        next(packets_of(live, "lsl:other"))

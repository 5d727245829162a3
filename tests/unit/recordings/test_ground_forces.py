"""Ground reaction forces of a table beside markers: known plates come back."""

from __future__ import annotations

import numpy as np
import pytest
from opensim_bench import small_trc

from armimpedance.app.cli.main import run as main
from armimpedance.core.errors import InputError
from armimpedance.joint.body.rows import about_world_origin
from armimpedance.recordings.opening import open_recording
from armimpedance.recordings.reading import ReadOptions

#: OpenSim's axes (x forward, y up, z right) in the world's (x forward, y left, z up).
TURN = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
NAMES = [
    ("ground_force_v{}", "ground_force_p{}", "ground_torque_{}"),
    ("1_ground_force_v{}", "1_ground_force_p{}", "1_ground_torque_{}"),
]


class Table:
    """Two plates under a load that changes slowly, in OpenSim's axes."""

    def __init__(self, rate=100.0, seconds=0.2, names=NAMES):
        self.time = np.arange(round(seconds * rate) + 1) / rate
        self.names = names
        self.force, self.point, self.torque = (self.of(self.time, part) for part in range(3))

    @staticmethod
    def of(t, part):
        wave = np.sin(3 * t + part)[:, None, None] * np.array([[1.0, 2.0, 3.0], [2.0, 1.0, -1.0]])
        base, size = [((5, 300, -8), 20.0), ((0.4, 0, 0.2), 0.03), ((0, 4, 0), 0.5)][part]
        return np.array(base) + size * wave

    def wrenches(self, t):
        """By the plates on the body about the world's origin, in the world's frame."""
        force, point, torque = (self.of(t, part) @ TURN.T for part in range(3))
        return np.concatenate([force, torque + np.cross(point, force)], axis=2)

    def write(self, tmp_path, change=lambda _columns: None):
        columns = {"time": self.time}
        for k, names in enumerate(self.names):
            for name, values in zip(names, (self.force, self.point, self.torque), strict=True):
                columns |= {name.format(a): values[:, k, i] for i, a in enumerate("xyz")}
        change(columns)
        head = f"grf\nversion=1\nnRows={len(self.time)}\nnColumns={len(columns)}\ninDegrees=yes\n"
        rows = ["\t".join(map(repr, row)) for row in np.column_stack([*columns.values()]).tolist()]
        file = tmp_path / "grf.mot"
        file.write_text(head + "endheader\n" + "\n".join(["\t".join(columns), *rows]) + "\n")
        return file


def read(tmp_path, forces):
    (tmp_path / "walk.trc").write_bytes(small_trc())
    return open_recording(tmp_path / "walk.trc", ReadOptions(forces=forces))


def world(markers):
    return about_world_origin(markers.wrenches, markers.plate_origins_m)


@pytest.mark.parametrize(
    ("force", "torque", "plates"),
    [
        ("{}ground_force_", "{}ground_torque_", ("", "1_")),
        ("{}_ground_force_", "{}_ground_torque_", "RL"),
        ("ground_force_{}_", "ground_torque_{}_", "rl"),
        ("ground_force_{}_", "ground_force_{}_m", "12"),
        ("ground_force_{}_", "ground_moment_{}_m", "12"),
    ],
)
def test_known_plates_come_back_under_every_name(force, torque, plates, tmp_path):
    starts = [(force.format(k), torque.format(k)) for k in plates]
    table = Table(names=[(f + "v{}", f + "p{}", t + "{}") for f, t in starts])
    markers = read(tmp_path, table.write(tmp_path))
    np.testing.assert_allclose(world(markers), table.wrenches(markers.time_s), atol=1e-9)
    assert (markers.wrenches[:, :, 2] > 200).all()
    np.testing.assert_allclose(markers.plate_origins_m[:, 2], 0, atol=0.1)


@pytest.mark.parametrize("rate", [1000.0, 600.0, 1080.0, 250.0, 99.97])
def test_another_rate_is_brought_to_the_markers(rate, tmp_path):
    """Slow loads lose nothing, and nothing drifts: 5 ms late would be 3 N and .3 N m."""
    table = Table(rate, seconds=1.0)
    markers = read(tmp_path, table.write(tmp_path))
    truth = table.wrenches(markers.time_s)
    np.testing.assert_allclose(world(markers), truth, atol=0.05)
    assert any("brought to 100 samples/s" in s for s in markers.provenance) == (rate != 99.97)


def test_a_start_in_the_middle_of_the_table(tmp_path):
    table = Table(1000.0, seconds=1.0)
    table.time = table.time - 0.4
    table.force, table.point, table.torque = (table.of(table.time, part) for part in range(3))
    markers = read(tmp_path, table.write(tmp_path))
    np.testing.assert_allclose(world(markers), table.wrenches(markers.time_s), atol=1e-3)


def test_no_point_without_a_load(tmp_path):
    def unloaded(columns):
        for axis in "xyz":
            columns[f"ground_force_v{axis}"][:] = 0.0
            columns[f"ground_force_p{axis}"][5:] = np.nan

    table = Table()
    markers = read(tmp_path, table.write(tmp_path, unloaded))
    np.testing.assert_allclose(markers.wrenches[:, 0, :3], 0.0)
    assert np.isfinite(markers.wrenches).all()
    truth = table.wrenches(markers.time_s)
    np.testing.assert_allclose(world(markers)[:, 1], truth[:, 1], atol=1e-9)


def test_what_is_no_plate_is_told(tmp_path):
    table = Table()
    markers = read(tmp_path, table.write(tmp_path, lambda c: c.update(emg=table.time * 2)))
    assert "Not taken: emg (no force plate's)." in markers.provenance


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda c: c.pop("ground_force_pz"), "column ground_force_pz: no such column"),
        (lambda c: c.pop("1_ground_torque_y"), "column 1_ground_torque_y: no such column"),
        (lambda c: c["ground_force_vy"].__imul__(-1), "ground_force: its load does not point up"),
        (lambda c: c["ground_torque_y"].__setitem__(4, 1e200), "a force or torque of 1e.200"),
        (lambda c: c["ground_force_px"].__imul__(1000), "acts .* m away"),
        (lambda c: c["ground_force_px"].__setitem__(4, np.nan), "no point where the force acts at"),
        (lambda c: c["ground_force_vx"].__setitem__(4, np.nan), "ground_force_vx: not a finite"),
        (lambda c: c["time"].__imul__(1e-4), "forces at 1e.06 samples/s"),
        (lambda c: c["time"].__iadd__(0.05), "forces from 0.05 to"),
        (lambda c: [c.pop(n) for n in list(c) if "force_v" in n], "no force plate"),
    ],
)
def test_one_line_for_whatever_is_wrong(change, told, tmp_path):
    with pytest.raises(InputError, match=told) as error:
        read(tmp_path, Table().write(tmp_path, change))
    assert "grf.mot" in str(error.value)
    assert "\n" not in str(error.value)


def test_converted_beside_markers_and_read_back(tmp_path):
    """By the command: the folder holds the same wrenches; a table of angles takes no forces."""
    table = Table(1000.0)
    (tmp_path / "walk.trc").write_bytes(small_trc())
    forces, out = table.write(tmp_path), tmp_path / "session"
    words = ["convert", str(tmp_path / "walk.trc"), str(out), "--forces", str(forces)]
    assert main(words) == 0
    markers = open_recording(out)
    np.testing.assert_allclose(world(markers), table.wrenches(markers.time_s), atol=1e-3)
    table_alone = ["convert", str(forces), str(tmp_path / "b"), "--forces", str(forces)]
    assert main([*table_alone, "--skeleton", "elbow", "--mass-kg", "70", "--height-m", "1.8"]) == 2

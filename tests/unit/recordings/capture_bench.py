"""Motion-capture C3D files written byte by byte, for any processor, with plates of a truth."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, field

import numpy as np

PROCESSORS = {"intel": 84, "dec": 85, "mips": 86}
Value = list[str] | np.ndarray


def vax(value: float) -> bytes:
    """A real as a VAX has it: 0.1m x 2^(e - 128), its two halves swapped."""
    if value == 0:
        return bytes(4)
    mantissa, exponent = math.frexp(abs(value))
    fraction = round(mantissa * 2**24) - 2**23
    bits = ((value < 0) << 31) | ((exponent + 128) << 23) | fraction
    return struct.pack("<HH", bits >> 16, bits & 0xFFFF)


def whole(*values: int) -> np.ndarray:
    """A parameter of integers."""
    return np.array(values, np.int64)


def real(*values: float) -> np.ndarray:
    """A parameter of reals."""
    return np.array(values, float)


@dataclass
class C3dFile:
    """A file of motion capture, of reals or of integers, as any of the three processors writes."""

    points: np.ndarray  # (F, P, 3) in `unit`
    labels: list[str]
    analog: dict[str, np.ndarray] = field(default_factory=dict)  # (F * samples_per_frame,)
    units: dict[str, str] = field(default_factory=dict)
    groups: dict[str, dict[str, Value]] = field(default_factory=dict)
    unit: str = "mm"
    rate: float = 100.0
    samples_per_frame: int = 1
    processor: str = "intel"
    reals: bool = True
    point_step: float = 0.05
    analog_steps: dict[str, float] = field(default_factory=dict)
    first_frame: int = 1
    last_frame: int | None = None
    residual: float = 0.0
    lost: tuple[tuple[int, int], ...] = ()
    header_events: tuple[tuple[str, float], ...] = ()
    tail: bytes = b""

    @property
    def order(self) -> str:
        return ">" if self.processor == "mips" else "<"

    def _ints(self, values: np.ndarray) -> bytes:
        return (np.asarray(values, np.int64) & 0xFFFF).astype(f"{self.order}u2").tobytes()

    def _floats(self, values: np.ndarray) -> bytes:
        flat = np.asarray(values, np.float32).ravel()
        if self.processor == "dec":
            return b"".join(vax(float(v)) for v in flat)
        return flat.astype(f"{self.order}f4").tobytes()

    def _parameter(self, value: Value) -> bytes:
        if isinstance(value, list):
            width = max(map(len, value), default=0)
            raw = b"".join(text.encode().ljust(width) for text in value)
            return struct.pack("bBBB", -1, 2, width, len(value)) + raw
        sizes = value.shape[::-1]
        head = struct.pack("bB", 2 if value.dtype.kind == "i" else 4, len(sizes)) + bytes(sizes)
        return head + (self._ints(value) if value.dtype.kind == "i" else self._floats(value))

    def _section(self, data_block: int) -> bytes:
        """The parameters; arrays are given with their slowest dimension first."""
        entries = []
        for number, (group, parameters) in enumerate(self.parameters(data_block).items(), start=1):
            entries.append((struct.pack("bb", len(group), -number) + group.encode(), b"\0"))
            for name, value in parameters.items():
                head = struct.pack("bb", len(name), number) + name.encode()
                entries.append((head, self._parameter(value) + b"\0"))
        raw = b"".join(
            head + self._ints(whole(2 + len(body) if i + 1 < len(entries) else 0)) + body
            for i, (head, body) in enumerate(entries)
        )
        blocks = -(-(len(raw) + 4) // 512)
        head = bytes([1, 0x50, blocks & 0xFF, PROCESSORS[self.processor]])
        return (head + raw).ljust(512 * blocks, b"\0")

    def parameters(self, data_block: int) -> dict[str, dict[str, Value]]:
        names, n = list(self.analog), len(self.points)
        made: dict[str, dict[str, Value]] = {
            "POINT": {
                "USED": whole(len(self.labels)),
                "SCALE": real(-1.0 if self.reals else self.point_step),
                "RATE": real(self.rate),
                "DATA_START": whole(data_block),
                "FRAMES": whole(min(n, 65535)),
                "LABELS": self.labels,
                "UNITS": [self.unit],
            },
            "ANALOG": {
                "USED": whole(len(names)),
                "LABELS": names,
                "UNITS": [self.units.get(name, "V") for name in names],
                "GEN_SCALE": real(1.0),
                "SCALE": real(*(self._step(name) for name in names)),
                "OFFSET": whole(*(0 for _ in names)),
                "RATE": real(self.rate * self.samples_per_frame),
            },
            "FORCE_PLATFORM": {"USED": whole(0)},
        }
        for group, values in self.groups.items():
            made[group] = {**made.get(group, {}), **values}
        return made

    def _step(self, name: str) -> float:
        return 1.0 if self.reals else float(np.float32(self.analog_steps.get(name, 0.01)))

    def _words(self) -> np.ndarray:
        frames, n = self.points.shape[:2]
        step = 1.0 if self.reals else float(np.float32(self.point_step))
        words = np.full((frames, n, 4), self.residual)
        words[..., :3] = self.points / step
        for frame, point in self.lost:
            words[frame, point] = (0, 0, 0, -1)
        channels = [v / self._step(name) for name, v in self.analog.items()]
        samples = np.column_stack([*channels]) if channels else np.zeros((frames, 0))
        return np.hstack([words.reshape(frames, -1), samples.reshape(frames, -1)])

    def write(self) -> bytes:
        frames, n = self.points.shape[:2]
        words = self._words()
        data = self._floats(words) if self.reals else self._ints(np.round(words))
        parameters = self._section(2)
        block = 2 + len(parameters) // 512
        parameters = self._section(block)
        last = self.first_frame + frames - 1 if self.last_frame is None else self.last_frame
        per_frame = len(self.analog) * self.samples_per_frame
        header = bytes([2, 0x50]) + self._ints(whole(n, per_frame, self.first_frame, last, 10))
        header += self._floats(real(-1.0 if self.reals else self.point_step))
        header += self._ints(whole(block, self.samples_per_frame)) + self._floats(real(self.rate))
        header = header.ljust(298, b"\0")
        if self.header_events:
            header += self._ints(whole(12345, len(self.header_events), 0))
            header += self._floats(real(*(t for _, t in self.header_events)))
            header = header.ljust(396, b"\0")
            header += b"".join(label.encode().ljust(4) for label, _ in self.header_events)
        whole_file = header.ljust(512, b"\0") + parameters + data + self.tail
        return whole_file.ljust(-(-len(whole_file) // 512) * 512, b"\0")


@dataclass
class PlateTruth:
    """What a body does on one plate, in the lab's axes: SI, all by the plate on the body."""

    corners: np.ndarray  # (4, 3) m, in the manual's order
    force: np.ndarray  # (S, 3)
    place: np.ndarray  # (S, 3): a point of the line of action, on the surface
    free: np.ndarray  # (S,): free moment about the surface's normal that points up
    to_surface: np.ndarray = field(default_factory=lambda: np.array([0.002, -0.003, -0.04]))
    sensors: tuple[float, float] = (0.21, 0.26)

    @property
    def axes(self) -> np.ndarray:
        """The plate's axes as rows: x from corner 2 to 1, y from corner 4 to 1, z = x x y."""
        x, y = self.corners[0] - self.corners[1], self.corners[0] - self.corners[3]
        x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
        return np.array([x, y, np.cross(x, y)])

    def moment(self, about: np.ndarray) -> np.ndarray:
        """The moment (S, 3) about a point of the lab."""
        return np.cross(self.place - about, self.force) - self.free[:, None] * self.axes[2]

    def channels(self, kind: int, by_plate: bool, length: float) -> np.ndarray:
        """What a plate of this type records, (S, c), lengths in `length` m, moments with it."""
        sign, R = (1.0 if by_plate else -1.0), self.axes
        force, centre = sign * self.force @ R.T, self.corners.mean(axis=0)
        if kind == 1:
            place = (self.place - centre) @ R.T / length
            free = sign * -self.free / length
            return np.column_stack([force, place[:, :2], free])
        if kind in (2, 4):
            origin = centre - self.to_surface @ R
            return np.hstack([force, sign * self.moment(origin) @ R.T / length])
        a, b = self.sensors
        origin = centre - np.array([0, 0, self.to_surface[2]]) @ R
        six = np.hstack([force, sign * self.moment(origin) @ R.T])
        # Each sensor's force acts at its place: f_i e_i and r_i x f_i e_i.
        places = [(0, b), (0, -b), (a, 0), (-a, 0), (a, b), (-a, b), (-a, -b), (a, -b)]
        ways = [(1, 0, 0), (1, 0, 0), (0, 1, 0), (0, 1, 0)] + 4 * [(0, 0, 1)]
        sensor = [
            [*way, *np.cross((*place, 0.0), way)] for place, way in zip(places, ways, strict=True)
        ]
        return six @ np.linalg.pinv(np.array(sensor, float).T).T


def corners(
    centre: np.ndarray, along: np.ndarray, up: np.ndarray, x: float, y: float
) -> np.ndarray:
    """Corners (4, 3) of a plate of edges x, y whose own z axis points down."""
    across = np.cross(-up, along)
    signs = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    return np.array([centre + i * x / 2 * along + j * y / 2 * across for i, j in signs])


def a_load(corner: np.ndarray, up: np.ndarray, samples: int, seed: int = 0) -> PlateTruth:
    """A body that stands on a plate and sways."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, samples)[:, None]
    along, across = corner[0] - corner[1], corner[0] - corner[3]
    wave = np.cos(2 * np.pi * t * rng.uniform(0.5, 1.5, 3) + rng.uniform(0, 6, 3))
    force = (600 + 150 * wave[:, :1]) * up + 60 * (wave - (wave @ up)[:, None] * up)
    place = corner.mean(axis=0) + 0.3 * (wave[:, 1:2] * along + wave[:, 2:] * across) / 2
    return PlateTruth(corner, force, place, 4.0 * wave[:, 0])


def plate_group(
    truths: list[PlateTruth],
    kind: int,
    length: float,
    matrix: np.ndarray | None = None,
    zero: tuple[int, int] = (1, 0),
) -> dict[str, Value]:
    """The FORCE_PLATFORM group of plates of one type; lengths in units of `length` m."""
    count = 8 if kind == 3 else 6
    origins = [t.to_surface for t in truths]
    if kind == 3:
        origins = [np.array([*t.sensors, t.to_surface[2]]) for t in truths]
    if kind == 1:
        origins = [np.zeros(3) for _ in truths]
    group: dict[str, Value] = {
        "USED": whole(len(truths)),
        "TYPE": whole(*(kind for _ in truths)),
        "ZERO": whole(*zero),
        "CORNERS": np.array([t.corners for t in truths]) / length,
        "ORIGIN": np.array(origins) / length,
        "CHANNEL": np.arange(1, count * len(truths) + 1).reshape(len(truths), count),
    }
    if matrix is not None:
        # By columns: the slowest dimension first makes a transpose.
        group["CAL_MATRIX"] = np.array([matrix.T for _ in truths])
    return group


def on_plates(
    truths: list[PlateTruth],
    kind: int = 2,
    *,
    by_plate: bool = False,
    unit: str = "mm",
    length: float = 0.001,
    matrix: np.ndarray | None = None,
    up: np.ndarray | None = None,
    zero: tuple[int, int] = (1, 0),
    **rest: object,
) -> C3dFile:
    """A file of two markers above plates of one type."""
    per_frame = int(rest.get("samples_per_frame", 1))  # type: ignore[call-overload]
    frames = len(truths[0].force) // per_frame
    height = 1.0 * (np.array([0, 0, 1.0]) if up is None else up)
    seen = truths[0].corners.mean(axis=0) + height
    analog = {}
    for k, truth in enumerate(truths, start=1):
        recorded = truth.channels(kind, by_plate, length)
        if matrix is not None:
            recorded = recorded @ np.linalg.inv(matrix).T
        analog |= {f"P{k}_{i}": column for i, column in enumerate(recorded.T)}
    return C3dFile(
        points=np.stack([np.tile(seen, (frames, 1)), np.tile(seen + 0.1, (frames, 1))], 1) / length,
        labels=["hip", "head"],
        analog=analog,
        unit=unit,
        groups={"FORCE_PLATFORM": plate_group(truths, kind, length, matrix, zero)},
        **rest,  # type: ignore[arg-type]
    )


def valid_file() -> bytes:
    """A small sound file with plates, EMG and events: to be damaged."""
    up = np.array([0, 0, 1.0])
    corner = corners(np.array([0.4, 0.3, 0.0]), np.array([0, 1.0, 0]), up, 0.6, 0.4)
    file = on_plates([a_load(corner, up, 12)], samples_per_frame=2)
    file.analog["biceps"] = np.linspace(-1e-3, 1e-3, 12)
    file.groups["EVENT"] = {
        "USED": whole(1), "LABELS": ["Go"], "CONTEXTS": ["Left"], "TIMES": real(0.0, 0.02)[None],
    }  # fmt: skip
    return file.write()

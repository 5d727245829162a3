"""Tables of one session as programs of laboratories write them: each with one quirk.

After public descriptions of the formats: the ASCII export of Vicon Nexus ("Trajectories",
"Devices"), the CSV of OptiTrack Motive and of Delsys EMGworks, the stamps of the Lab Streaming
Layer, numbers of LabVIEW and Excel. Written here from simulated samples; nobody's file is copied.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from armimpedance.core.records import Recording

HEAD = ["trial", "time [s]", "x [m]", "y [m]", "Fx [N]", "Fy [N]"]


@dataclass(frozen=True)
class Quirk:
    """A writer of one file, and how exactly its samples come back.

    `trials`: whether the file says which trial a row belongs to.
    """

    write: Callable[[pd.DataFrame], str]
    trials: bool = True
    metres: float = 2e-7
    newtons: float = 2e-7


def table_of(recording: Recording) -> pd.DataFrame:
    """A row a sample, rounded as a file is; trials one below the other, each from 0 s."""
    start = np.repeat(recording.time_s[recording.offsets[:-1]], np.diff(recording.offsets))
    trial = np.repeat(recording.trials["trial"], np.diff(recording.offsets))
    values = np.column_stack([recording.time_s - start, recording.position, recording.force])
    table = pd.DataFrame(np.round(values, 7), columns=HEAD[1:])
    return pd.concat([pd.Series(trial.to_numpy(), name="trial"), table], axis=1)


def plain(table: pd.DataFrame, **how: object) -> str:
    return table.to_csv(index=False, **how)


# ---- ends ----------------------------------------------------------------------------------------


def padded(
    rows: Callable[[pd.DataFrame], pd.DataFrame], before: bool = False, **how: object
) -> Quirk:
    """Rows that are put after (before) the samples of every other trial."""

    def write(table: pd.DataFrame) -> str:
        parts = []
        for i, (_, own) in enumerate(table.groupby("trial", sort=False)):
            extra = rows(own) if i % 2 else own.iloc[:0]
            parts += [extra, own] if before else [own, extra]
        return plain(pd.concat(parts), **how)

    return Quirk(write)


def _like(own: pd.DataFrame, values: float, rows: int, keep: tuple[str, ...]) -> pd.DataFrame:
    made = own.iloc[-rows:].copy()
    made["time [s]"] = own["time [s]"].iloc[-1] + 0.001 * np.arange(1, rows + 1)
    made[[name for name in HEAD if name not in keep]] = values
    return made


ROW = ("trial", "time [s]")


def _held(own: pd.DataFrame) -> pd.DataFrame:
    """Fifteen rows of the last values; none where by chance the last two rows are alike."""
    made = _like(own, 0.0, 15, ROW)
    made[HEAD[2:]] = own[HEAD[2:]].iloc[-1].to_numpy()
    return made.iloc[: 15 * bool((own[HEAD[2:]].iloc[-1] != own[HEAD[2:]].iloc[-2]).any())]


ENDS = {
    "one row of zeros": padded(lambda own: _like(own, 0.0, 1, ROW)),
    "twelve rows of zeros": padded(lambda own: _like(own, 0.0, 12, ROW)),
    "zeros, the time too": padded(lambda own: _like(own, 0.0, 3, ("trial",))),
    "zeros, the trial's number too": padded(lambda own: _like(own, 0.0, 5, ())),
    "empty cells": padded(lambda own: _like(own, np.nan, 20, ROW)),
    "empty cells, the time too": padded(lambda own: _like(own, np.nan, 20, ("trial",))),
    "-999 as nothing": padded(lambda own: _like(own, -999.0, 4, ROW)),
    "one wild row": padded(lambda own: _like(own, 1.234, 1, ROW)),
    "empty cells before": padded(lambda own: _like(own, np.nan, 6, ("trial",)), before=True),
    "the last value again and again": padded(_held),
    **{
        f"{word} in the cells": padded(lambda own: _like(own, np.nan, 20, ROW), na_rep=word)
        for word in ("NaN", "#N/A", "-", "null")
    },
}

# ---- numbers -------------------------------------------------------------------------------------


def grouped(thousands: str, decimal: str, quote: bool = False) -> Quirk:
    """Millimetres from a corner of the table, some above a thousand."""

    def cell(value: float) -> str:
        text = f"{value:,.4f}".replace(",", "T").replace(".", decimal).replace("T", thousands)
        return f'"{text}"' if quote else text

    def write(table: pd.DataFrame) -> str:
        mark = "," if quote else ";"
        lines = [mark.join(["trial", "time [s]", "x [mm]", "y [mm]", "Fx [N]", "Fy [N]"])]
        for row in table.itertuples(index=False):
            values = [row[1], 1e3 * row[2] + 1000.0, 1e3 * row[3] + 1000.0, *row[4:]]
            lines.append(mark.join([str(int(row[0])), *map(cell, values)]))
        return "\n".join(lines) + "\n"

    return Quirk(write, metres=1e-7, newtons=1e-4)


def _stamped(form: Callable[[float], str]) -> Quirk:
    def write(table: pd.DataFrame) -> str:
        ticks = np.arange(len(table)) / 1000.0 + 5.0 * (table["trial"].to_numpy() - 1)
        stamps = [form(tick) for tick in ticks]
        return plain(table.drop(columns="time [s]").assign(timestamp=stamps))

    return Quirk(write)


def _clock(seconds: float) -> str:
    whole = round(seconds * 1000) % 86_400_000
    minutes, rest = divmod(whole, 60_000)
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{rest / 1000:06.3f}"


NUMBERS = {
    "German thousands": grouped(".", ","),
    "Swiss thousands": grouped("'", "."),
    "thousands after a thin blank": grouped("\u202f", ","),
    "thousands after a hard blank": grouped("\u00a0", ","),
    "quoted English thousands": grouped(",", ".", quote=True),
    "ISO stamps": _stamped(lambda t: f"2024-05-01T{_clock(t + 36_000)}Z"),
    "dates and times": _stamped(lambda t: f"2024-05-01 {_clock(t + 3_600)}"),
    "times of day": _stamped(lambda t: _clock(t + 36_000)),
    "times of day over midnight": _stamped(lambda t: _clock(t + 86_395)),
    "NA for what is missing": Quirk(lambda t: plain(_like_and(t), na_rep="NA")),
    "exponents": Quirk(lambda t: plain(t, float_format="%.8e")),
    "exponents of Fortran": Quirk(
        lambda t: re.sub(r"(\.\d+)E", r"\1D", plain(t, float_format="%.8E"))
    ),
    "the minus of typesetting": Quirk(lambda t: plain(t).replace("-", "\u2212")),
    "a sign before each number": Quirk(lambda t: re.sub(r",(?=\d)", ",+", plain(t))),
    "decimal commas": Quirk(lambda t: plain(t, sep=";", decimal=",")),
    "every cell in quotation marks": Quirk(lambda t: plain(t, quoting=csv.QUOTE_ALL)),
}


def _like_and(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(remark=np.nan)


# ---- headers -------------------------------------------------------------------------------------


def _lines(head: list[list[str]], rows: Iterator[list[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows(head)
    writer.writerows(rows)
    return text.getvalue()


def _first(table: pd.DataFrame) -> pd.DataFrame:
    return table[table["trial"] == table["trial"].iloc[0]]


def nexus(table: pd.DataFrame) -> str:
    """Vicon Nexus: a part's name, its rate, groups, names, units; frames in place of times."""
    head = [
        ["Devices"],
        ["1000"],
        ["", "", "Hand", "", "Cell", ""],
        ["Frame", "Sub Frame", "X", "Y", "Fx", "Fy"],
        ["", "", "mm", "mm", "N", "N"],
    ]
    rows = enumerate(_first(table).itertuples(index=False), start=1)
    return _lines(head, ([i, 0, 1e3 * r[2], 1e3 * r[3], r[4], r[5]] for i, r in rows))


def nexus_parts(table: pd.DataFrame) -> str:
    """Vicon Nexus: the devices' part above that of the trajectories, both with frames."""
    own = _first(table)
    cell = nexus(own).splitlines()
    without = [",".join([*line.split(",")[:2], *line.split(",")[4:]]) for line in cell[2:]]
    hand = [",".join(line.split(",")[:4]) for line in cell[2:]]
    head = ["Trajectories", "1000"]
    return "\n".join([*cell[:2], *without, "", *head, *hand]) + "\n"


def motive(table: pd.DataFrame) -> str:
    """OptiTrack Motive: facts in the first line, then type, name, number, kind, axis."""
    head = [
        ["Format Version", "1.23", "Take Name", "t", "Capture Frame Rate", "1000.000000"],
        [],
        ["", "", "Marker", "Marker", "Device", "Device"],
        ["", "", "hand", "hand", "cell", "cell"],
        ["", "", "Position", "Position", "Force", "Force"],
        ["Frame", "Time (Seconds)", "X (mm)", "Y (mm)", "X (N)", "Y (N)"],
    ]
    rows = _first(table).itertuples(index=False)
    return _lines(head, ([i, r[1], 1e3 * r[2], 1e3 * r[3], r[4], r[5]] for i, r in enumerate(rows)))


def delsys(table: pd.DataFrame) -> str:
    """Delsys EMGworks: a clock before every channel, the EMG's faster and longer."""
    own = _first(table)
    n = len(own)
    fast = round(2.148 * n)
    emg = np.sin(np.arange(fast))
    head = [["Label: run 1"], ["X[s]", "EMG 1 [V]", "X[s]", "Cell: Fx [N]", "X[s]", "Cell: Fy [N]",
            "X[s]", "Hand: x [m]", "X[s]", "Hand: y [m]"]]  # fmt: skip

    def rows() -> Iterator[list[object]]:
        for i in range(fast):
            row: list[object] = [f"{i / 2148:.6f}", f"{1e-5 * emg[i]:.9f}"]
            for name in ("Fx [N]", "Fy [N]", "x [m]", "y [m]"):
                row += [f"{i / 1000:.3f}", own[name].iloc[i]] if i < n else ["", ""]
            yield row

    return _lines(head, rows())


def labview(table: pd.DataFrame) -> str:
    """LabVIEW's measurement file: two heads, units in the second, a remark behind the first row."""
    own = _first(table)
    facts = ["LabVIEW Measurement", "Separator\tTab", "Decimal_Separator\t.", "Multi_Headings\tNo"]
    facts += ["X_Columns\tOne", "Date\t2024/05/01", "***End_of_Header***\t", "\t"]
    second = {
        "Channels": ["4"],
        "Samples": [str(len(own))] * 4,
        "Y_Unit_Label": ["m", "m", "N", "N"],
    }
    second |= {"X0": ["0.0"] * 4, "Delta_X": ["0.001"] * 4, "***End_of_Header***": [""] * 5}
    second |= {"X_Value": ["x", "y", "Fx", "Fy", "Comment"]}
    lines = [*facts, *("\t".join([name, *cells]) for name, cells in second.items())]
    return "\n".join(lines) + "\n" + own[HEAD[1:]].to_csv(sep="\t", index=False, header=False)


def _by_trial(write: Callable[[int, pd.DataFrame], str]) -> Quirk:
    """Trial after trial appended to one text."""
    return Quirk(
        lambda t: "".join(
            write(i, own) for i, (_, own) in enumerate(t.groupby("trial", sort=False))
        )
    )


def _renamed(*names: str) -> Callable[[pd.DataFrame], str]:
    return lambda table: plain(table.set_axis(list(names), axis=1))


HEADERS = {
    "Nexus, groups above the axes": Quirk(nexus, trials=False),
    "Nexus, parts one below the other": Quirk(nexus_parts, trials=False),
    "Motive, five lines of header": Quirk(motive, trials=False),
    "Delsys, a clock a channel": Quirk(delsys, trials=False),
    "units below the names": Quirk(
        lambda t: "trial,time,x,y,Fx,Fy\n,s,m,m,N,N\n" + plain(t, header=False)
    ),
    "a blank line and remarks above": Quirk(lambda t: "Rig 3\n# checked\n\n" + plain(t)),
    "a column twice that means nothing": Quirk(
        lambda t: plain(t.assign(a=1.5, b=2.5).set_axis([*HEAD, "spare", "spare"], axis=1))
    ),
    "a delimiter at the end of each row": Quirk(lambda t: plain(t).replace("\n", ",\n")),
    "names behind a #, blanks between": Quirk(
        lambda t: "# trial time_s x_m y_m Fx_N Fy_N\n" + plain(t, header=False, sep=" ")
    ),
    "columns of fixed width": Quirk(
        lambda t: t.set_axis([n.replace(" [", "_").strip("]") for n in HEAD], axis=1).to_string(
            index=False, float_format=lambda v: f"{v:.7f}"
        )
    ),
    "LabVIEW, two heads": Quirk(labview, trials=False),
    "groups above the axes, units in brackets": Quirk(
        lambda t: (
            "trial,time,position,,force,\n,s,x (m),y (m),x (N),y (N)\n" + plain(t, header=False)
        )
    ),
    "Excel's line on its delimiter": Quirk(lambda t: "sep=;\n" + plain(t, sep=";")),
    "the header again above each trial": _by_trial(lambda _, own: plain(own)),
    "a title and the header above each trial": _by_trial(
        lambda i, own: f"Trial {i + 1}\n{plain(own.drop(columns='trial'))}\n"
    ),
    "an empty line between trials": _by_trial(lambda i, own: plain(own, header=i == 0) + "\n"),
    "a remark below the last row": Quirk(lambda t: plain(t) + "End of file\n"),
    "rows longer than the header": Quirk(lambda t: re.sub(r"(?<=\d)\n", ",ok\n", plain(t))),
    "a mark of bytes, Windows' line ends": Quirk(
        lambda t: "\ufeff" + plain(t).replace("\n", "\r\n")
    ),
    "units after a slash": Quirk(
        _renamed("Trial No.", "Time / s", "Hand X / m", "Hand Y / m", "Force X / N", "Force Y / N")
    ),
    "the number of the row before it": Quirk(lambda t: t.to_csv()),
    "another order of columns": Quirk(lambda t: plain(t[[HEAD[i] for i in (5, 3, 0, 4, 1, 2)]])),
    "frames below a line with the rate": Quirk(
        lambda t: (
            "fs: 1000 Hz\n"
            + plain(t.drop(columns="time [s]").assign(frame=t.groupby("trial").cumcount()))
        )
    ),
}

# ---- clocks --------------------------------------------------------------------------------------


def _uneven(late_s: Callable[[int], np.ndarray], moved: bool) -> Quirk:
    """Stamps that are late; `moved`: the samples were taken then, else evenly."""

    def write(table: pd.DataFrame) -> str:
        parts = []
        for _, own in table.groupby("trial", sort=False):
            time = own["time [s]"].to_numpy()
            stamp = time + late_s(len(own))
            made = own.assign(**{"time [s]": np.round(stamp + 386_534.0, 9)})
            if moved:
                for name in HEAD[2:]:
                    made[name] = np.interp(stamp, time, own[name])
            parts.append(made)
        return plain(pd.concat(parts))

    # A sample's noise is not that of its neighbours: 6 standard deviations of 1.4 um and 0.05 N.
    return Quirk(write, metres=8.5e-6, newtons=0.3) if moved else Quirk(write)


def _noise(scale_s: float) -> Callable[[int], np.ndarray]:
    random = np.random.default_rng(3)
    return lambda n: random.normal(0.0, scale_s, n).clip(-0.45e-3, 0.45e-3)


CLOCKS = {
    "stamps of a network": _uneven(_noise(1.5e-4), moved=False),
    "stamps that alternate": _uneven(lambda n: 1.5e-4 * (np.arange(n) % 2), moved=False),
    "stamps in blocks": _uneven(lambda n: -8e-5 * (np.arange(n) % 5), moved=False),
    "polled samples": _uneven(_noise(1.5e-4), moved=True),
}


def _counted(name: str, per_s: int, first: int = 0, full: int = 2**62) -> Quirk:
    """Whole ticks of a clock that runs through the session, 5 s of rest between trials."""

    def write(table: pd.DataFrame) -> str:
        seconds = np.arange(len(table)) / 1000.0 + 5.0 * (table["trial"].to_numpy() - 1)
        ticks = (np.round(seconds * per_s).astype(np.int64) + first) % full
        return plain(table.drop(columns="time [s]").assign(**{name: ticks}))

    return Quirk(write)


TICKS = {
    "16 bits of milliseconds, full in a trial": _counted("clock [ms]", 1000, 65_036, 2**16),
    "32 bits of microseconds, full in a trial": _counted(
        "clock [us]", 10**6, 2**32 - 400_000, 2**32
    ),
    "seconds since 1970": Quirk(
        lambda t: plain(
            t.assign(**{"time [s]": 1_714_557_600.0 + np.arange(len(t)) / 1000 + 5.0 * t["trial"]})
        )
    ),
    "milliseconds since 1970": _counted("timestamp_ms", 1000, 1_714_557_600_000),
    "nanoseconds since 1970": _counted("timestamp_ns", 10**9, 1_714_557_600 * 10**9),
}

# ---- arrays --------------------------------------------------------------------------------------


def arrays(recording: Recording, order: str, fill: float) -> dict[str, object]:
    """Variables of a .mat: trials (t), samples (s) and axes (a) in an order, with padding."""
    lengths = np.diff(recording.offsets)
    made: dict[str, object] = {"fs": recording.sample_rate_hz, "nSamples": lengths.astype(float)}
    for name, samples in (("pos", recording.position), ("force", recording.force)):
        block = np.full((len(lengths), lengths.max(), 2), fill)
        for i, first in enumerate(recording.offsets[:-1]):
            block[i, : lengths[i]] = samples[first : first + lengths[i]]
        made[name] = block.transpose(["tsa".index(axis) for axis in order])
    return made


ARRAYS = [(order, fill) for order in ("tsa", "sat", "ast", "tas", "sta") for fill in (0.0, np.nan)]


def _signals(recording: Recording, row: int) -> dict[str, np.ndarray]:
    at = slice(*recording.offsets[[row, row + 1]])
    x, y = recording.position[at].T
    fx, fy = recording.force[at].T
    # twice as many samples of a muscle
    emg = np.sin(np.arange(2 * len(x)) / 3.0)
    return {"Hand X": x, "Cell X": fx, "EMG biceps": emg, "Hand Y": y, "Cell Y": fy}


def labchart(recording: Recording) -> dict[str, object]:
    """LabChart: one vector of all samples, a block a trial, two rates, a channel that was off."""
    parts: list[np.ndarray] = []
    shape = (6, recording.n_trials)
    made = {name: np.full(shape, -1.0) for name in ("datastart", "dataend", "unittextmap")}
    made["samplerate"] = np.zeros(shape)
    for block in range(recording.n_trials):
        for c, (name, values) in enumerate(_signals(recording, block).items()):
            made["datastart"][c, block] = 1 + sum(map(len, parts))
            parts.append(values)
            made["dataend"][c, block] = sum(map(len, parts))
            made["samplerate"][c, block] = 2000.0 if name.startswith("EMG") else 1000.0
            made["unittextmap"][c, block] = 1 + ["Hand", "Cell", "EMG"].index(name.split()[0])
    titles = [*_signals(recording, 0), "Channel 6"]
    texts = {"titles": np.array(titles), "unittext": np.array(["m", "N", "V"])}
    return {**made, **texts, "data": np.concatenate(parts)[None], "tickrate": 2000.0}


def spike2(recording: Recording) -> dict[str, object]:
    """Spike2: a struct a channel, of one trial; events beside them."""
    units = {"Hand": "m", "Cell": "N", "EMG": "V"}
    channels = {
        f"V1_Ch{i}": {
            "title": name,
            "units": units[name.split()[0]],
            "interval": 5e-4 if name.startswith("EMG") else 1e-3,
            "start": 2.5,
            "length": float(len(values)),
            "values": values[:, None],
        }
        for i, (name, values) in enumerate(_signals(recording, 0).items(), start=1)
    }
    return {**channels, "V1_Ch31": {"title": "Keyboard", "times": np.array([[0.5]]), "length": 1.0}}

"""The experiments of Tsuji (1997): a robot pushes the hand."""

from __future__ import annotations

import argparse
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from armimpedance.core.errors import InputError
from armimpedance.core.progress import Progress
from armimpedance.lab.parts.simulation import Simulated, SimulatedRig

if TYPE_CHECKING:
    from manipulandum_sim.hand import Servo, SimulatedSubject


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--sets", type=int, default=5, help="sets of 8 disturbances (5)")
    parser.add_argument("--disturbance", default="minimum_jerk", metavar="SHAPE")
    parser.add_argument("--duration-s", type=float, default=0.3, help="of a disturbance (0.3)")
    parser.add_argument("--amplitude-mm", type=float, default=5.0, help="of a disturbance (5)")
    parser.add_argument(
        "--servo",
        metavar="STIFFNESS",
        help="of the robot's servo in N/m, or 'ideal' (default: a servo of 20000 N/m)",
    )
    parser.add_argument(
        "--reflex",
        type=float,
        metavar="SHARE",
        help="a stretch reflex, delayed by 55 ms, of this share of the stiffness",
    )


def _add_places(parser: argparse.ArgumentParser) -> None:
    _add_options(parser)
    parser.add_argument(
        "--at",
        nargs=2,
        type=float,
        action="append",
        metavar=("X", "Y"),
        help="a hand location of your own, m from the shoulder; repeatable",
    )
    parser.add_argument(
        "--grid",
        nargs=6,
        type=float,
        metavar=("LEFT", "RIGHT", "COLUMNS", "NEAR", "FAR", "ROWS"),
        help="hand locations in columns and rows, such as -0.2 0.2 5 0.3 0.5 3 (m)",
    )
    parser.add_argument(
        "--strength",
        type=float,
        metavar="FACTOR",
        help="of the subject's muscles: their tension, stiffness and viscosity",
    )


def _places(arguments: argparse.Namespace) -> list[tuple[float, float]] | None:
    """Hand locations of --at and --grid; None for the source's own."""
    import numpy as np

    places = [(x, y) for x, y in getattr(arguments, "at", None) or ()]
    if (grid := getattr(arguments, "grid", None)) is not None:
        left, right, columns, near, far, rows = grid
        if min(columns, rows) < 1 or not float(columns * rows).is_integer():
            raise InputError(
                f"--grid with {columns:g} columns and {rows:g} rows", expected="1 or more of each"
            )
        across = np.linspace(left, right, int(columns)).tolist()
        places += [(x, y) for y in np.linspace(near, far, int(rows)).tolist() for x in across]
    return places or None


def _read_subject(file: Path) -> SimulatedSubject:
    """A subject of one's own: a JSON file with the fields of `SimulatedSubject`.

    Raises InputError: the file cannot be read, or a field is missing, unknown or not above 0.
    """
    from armimpedance.core.json_text import Fields, is_number, read_json
    from manipulandum_sim.hand import SimulatedSubject

    values = read_json(file, "a simulated subject")
    given, known = Fields(file, values), [f.name for f in fields(SimulatedSubject)]
    for name in values:
        if name not in known:
            raise InputError("unknown field", file=file, column=name, expected=", ".join(known))
    values = {"id": file.stem, "strength": 1.0, **values}
    for name in ("mass_kg", "height_m", "upper_arm_m", "forearm_hand_m", "strength"):
        if not is_number(values.get(name)) or not values[name] > 0:
            raise given.wrong(name, "a number above 0")
    return SimulatedSubject(**values)


def _subject(arguments: argparse.Namespace) -> SimulatedSubject:
    """A subject by its letter or its file, and as strong as asked for."""
    from manipulandum_sim.hand import find_subject

    name = arguments.subject or "A"
    subject = _read_subject(Path(name)) if name.endswith(".json") else find_subject(name)
    strength = getattr(arguments, "strength", None)
    return subject if strength is None else replace(subject, strength=strength)


def _simulate(name: str, arguments: argparse.Namespace, progress: Progress) -> Simulated:
    from manipulandum_sim.hand import Reflex, simulate

    recording, truth = simulate(
        name,
        subject=_subject(arguments),
        seed=arguments.seed,
        sets=arguments.sets,
        places=_places(arguments),
        progress=progress,
        disturbance=arguments.disturbance,
        duration_s=arguments.duration_s,
        amplitude_m=arguments.amplitude_mm / 1e3,
        noise=arguments.noise,
        servo=servo_asked(arguments.servo),
        reflex=None if arguments.reflex is None else Reflex(arguments.reflex),
    )
    return Simulated(recording, truth)


def servo_asked(asked: str | None) -> Servo:
    """The servo that an option names: N/m, or ideal."""
    from manipulandum_sim.hand import IDEAL, Servo

    if asked is None:
        return Servo()
    if asked == "ideal":
        return IDEAL
    try:
        return Servo(float(asked))
    except ValueError as error:
        raise InputError(f"--servo {asked}", expected="N/m, or ideal") from error


_SUBJECTS: Final = (
    "A (default) to D, A_alike (stiffness hardly changes with posture), or a file of your own: "
    '{"mass_kg": 70, "height_m": 1.8, "upper_arm_m": 0.31, "forearm_hand_m": 0.35}'
)


def _rig(name: str, line: str) -> SimulatedRig:
    own = name == "postures"
    options = "--grid -0.2 0.2 3 0.3 0.5 2" if own else "--subject B --noise sensor --seed 7"
    add = _add_places if own else _add_options
    options = f"{options} --out session"
    return SimulatedRig(name, line, options, _simulate, add, subjects=_SUBJECTS)


RIGS: Final = (
    _rig("postures", "Tsuji (1997): a relaxed arm at 20 hand locations (subject A) or 11"),
    _rig("cocontraction", "Tsuji (1997): co-contraction of 0 to 30 percent MVC"),
    _rig("force", "Tsuji (1997): the hand bears 0.5 to 3 x 9.8 N"),
)

"""Write a simulated experiment as a recording, with its truth.

Examples:
  armimpedance simulate cocontraction --out session
  armimpedance simulate postures --subject B --noise sensor --seed 7 --out session
  armimpedance simulate force --disturbance biphasic --servo 5000 --out session
  armimpedance simulate p5 --subject 2 --out relaxed
  armimpedance simulate body --out walking
  armimpedance simulate elbow-varying --subject 3 --frequency-hz 1.5 --out moving
  armimpedance simulate therapy --subject P2 --out patient

Experiments of Tsuji (1997): postures (relaxed, 20 hand locations for subject A, 11 for B to D),
cocontraction (0 to 30 % MVC), force (0.5 to 3 x 9.8 N). The folder also gets truth.json: M, B and
K of the simulated limb, found by differentiating the simulated plant.

Rigs of moving bodies: p5 (a relaxed arm swings while the trunk is shaken) and release (the forearm
is lifted and let go), after Venture, markers at 30 frames/s, subjects 1 and 2; body (twelve motions
on two force plates, joint angles and contact forces, subjects A and B).

The elbow in a powered exoskeleton, after Ruiz (2011), subjects 1 to 4, with raw EMG: elbow (a held
posture, random torque), elbow-cocontraction (levels of both muscles), elbow-varying (stiffness goes
up and down), elbow-calibration (isometric, for the index of co-contraction), elbow-spring,
elbow-damper, elbow-inertia (a rhythmic movement against a rendered load).

A robot for arm therapy of five axes, after Guidali (2013): therapy (passive, active, half active,
resistive movements; subjects S1 to S12, and P1 to P7 with neurological problems),
therapy-calibration (sweeps and holds of the empty robot), therapy-validation (movements of the
empty robot), therapy-mockup (two pipes for an arm). The folder also gets the robot's drawings.json.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from armimpedance.records import Recording
    from manipulandum_sim.elbow import ElbowTruth
    from manipulandum_sim.hand import Servo, Truth

TRUTH_FILE = "truth.json"
#: Of disturbances, and repetitions of an elbow test.
SETS = 5
ELBOW_TESTS = {
    "elbow": "posture",
    **{
        f"elbow-{test}": test
        for test in ("cocontraction", "varying", "calibration", "spring", "damper", "inertia")
    },
}
THERAPY_TESTS = ("therapy", "therapy-calibration", "therapy-validation", "therapy-mockup")
RIGS = ("p5", "release", "body", *ELBOW_TESTS, *THERAPY_TESTS)


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "experiment",
        metavar="RIG|EXPERIMENT",
        help="postures, cocontraction, force; p5, release, body; elbow, elbow-varying, ...; "
        "therapy, ...",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    parser.add_argument(
        "--subject",
        metavar="NAME",
        help="A (default) to D; p5, release: 1 (default) or 2; body: A (default) or B; elbow: 1 "
        "(default) to 4; therapy: S1 (default) to S12, P1 to P7",
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--sets",
        type=int,
        help="sets of 8 disturbances; elbow: repetitions (default: 5); therapy: the same (3)",
    )
    parser.add_argument("--noise", default="nominal", help="nominal (default), sensor or none")
    parser.add_argument("--disturbance", default="minimum_jerk", metavar="SHAPE")
    parser.add_argument(
        "--duration-s",
        type=float,
        help="of a disturbance (default: 0.3); elbow: of a trial (default: 10)",
    )
    parser.add_argument("--amplitude-mm", type=float, default=5.0)
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
    parser.add_argument("--markers", action="store_true", help="body: 35 markers, not joint angles")
    parser.add_argument(
        "--commanded", action="store_true", help="elbow: hold the motor's torque, of arm and device"
    )
    parser.add_argument(
        "--perturbation", choices=("white", "prbs"), help="elbow: default white, below 10 Hz"
    )
    parser.add_argument(
        "--frequency-hz", type=float, metavar="HZ", help="elbow-varying: default 0.7"
    )
    parser.add_argument(
        "--law", choices=("linear", "saturating"), help="elbow: of stiffness over EMG"
    )
    parser.add_argument(
        "--mismatched",
        action="store_true",
        help="therapy-validation: heavier, with more friction and stiffer cables than calibrated",
    )
    parser.add_argument(
        "--lowering", action="store_true", help="therapy: the arm is let down again, recorded too"
    )
    parser.add_argument("--table", choices=("parquet", "csv"), default="parquet")


def run(arguments: argparse.Namespace) -> int:
    """Simulate and write recording and truth."""
    from armimpedance.cli.inspect import describe
    from armimpedance.cli.parts.checks import check_seed
    from armimpedance.cli.parts.progress import bar
    from armimpedance.cli.simulated.elbow import refuse_elbow_options, simulate_elbow_test
    from armimpedance.cli.simulated.therapy import refuse_therapy_options, simulate_therapy_test
    from armimpedance.errors import InputError
    from manipulandum_sim.hand import EXPERIMENTS, Reflex, simulate

    check_seed(arguments.seed)
    if arguments.experiment in THERAPY_TESTS:
        return simulate_therapy_test(arguments, arguments.experiment)
    refuse_therapy_options(arguments)
    if arguments.experiment in ELBOW_TESTS:
        return simulate_elbow_test(arguments, ELBOW_TESTS[arguments.experiment])
    refuse_elbow_options(arguments)
    if arguments.experiment in RIGS:
        from armimpedance.cli.simulated.bodies import simulate_rig

        return simulate_rig(arguments)
    if arguments.experiment not in EXPERIMENTS:
        known = ", ".join((*EXPERIMENTS, *RIGS))
        raise InputError(f"no experiment {arguments.experiment!r}", expected=f"one of {known}")
    if arguments.markers:
        raise InputError(f"--markers with {arguments.experiment}", expected="it with body")
    with bar("simulating") as progress:
        recording, truth = simulate(
            arguments.experiment,
            subject=arguments.subject or "A",
            seed=arguments.seed,
            sets=SETS if arguments.sets is None else arguments.sets,
            progress=progress,
            disturbance=arguments.disturbance,
            duration_s=0.3 if arguments.duration_s is None else arguments.duration_s,
            amplitude_m=arguments.amplitude_mm / 1e3,
            noise=arguments.noise,
            servo=_servo(arguments.servo),
            reflex=None if arguments.reflex is None else Reflex(arguments.reflex),
        )
    write_simulated(recording, truth, arguments.out, arguments.table)
    print(describe(recording, str(arguments.out)))
    return 0


def write_simulated(
    recording: Recording,
    truth: Truth | ElbowTruth,
    folder: Path,
    table: Literal["parquet", "csv"] = "parquet",
) -> None:
    """Write a recording with its truth beside it, both or neither."""
    from armimpedance.outputs import RECORDING_FILES, staged_folder
    from armimpedance.recordings import write_folder

    folder.parent.mkdir(parents=True, exist_ok=True)
    with staged_folder(folder, known=(*RECORDING_FILES, TRUTH_FILE)) as staged:
        write_folder(recording, staged, table=table)
        truth.write(staged / TRUTH_FILE)


def _servo(asked: str | None) -> Servo:
    from armimpedance.errors import InputError
    from manipulandum_sim.hand import IDEAL, Servo

    if asked is None:
        return Servo()
    if asked == "ideal":
        return IDEAL
    try:
        return Servo(float(asked))
    except ValueError as error:
        raise InputError(f"--servo {asked}", expected="N/m, or ideal") from error

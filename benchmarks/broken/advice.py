"""What to do about each violation: one plain sentence, as the page of the docs prints it."""

from __future__ import annotations

from typing import Final

_UNITS: Final = (
    "Give SI units: N, N m, m, rad. A simple check: the limb's inertia must be a limb's."
)
_COPIES: Final = "Take the copies out: each trial counts once, else every interval is too narrow."
_SIGN: Final = "Say whose force the sensor holds (`force_by`), or turn the sign once, for all axes."
_LATE: Final = "Record all channels on one clock, or tell how much later one of them is."
_AXES: Final = "Push the handle by hand along each axis and see which column answers."
_RELAX: Final = "Ask the person to relax, record EMG, leave out the trials in which a muscle works."
_LINEAR: Final = "Use smaller motions, and say at which amplitude the numbers hold."
_TORQUE: Final = "Record the command or the perturbation and say what the rig imposes (`imposed`)."
_MASS: Final = "Weigh or scale the segments, and say how well the masses are known."
_LOST: Final = "Mend the acquisition; leave out the trials in which samples repeat."
_GAIN: Final = (
    "Hang a known weight on the sensor before every session: no record shows a gain that is a "
    "little off."
)

_SESSION: Final = (
    "Look at the trial that is named, calibrate the sensor, estimate the parts apart (`--by set`)."
)
_LAW: Final = "Take k and h beside the law that is named; swing at the speeds that you ask about."
_FILTER: Final = "Record force and position through the same filter, or through none."

#: Violation -> what to do.
ADVICE: Final[dict[str, str]] = {
    "another law of damping or friction": _LAW,
    "damping by the square of the velocity": _LAW,
    "joint sticks": _LAW,
    "joint yields like muscle": _LAW,
    "axes of the file": "Name the file's axes forward, left and up where it is converted.",
    "a gain changes in the middle": _SESSION,
    "a gain drifts": _SESSION,
    "one channel from the middle on": _SESSION,
    "one axis in the last set": "Turn the sign back in the trials that are named.",
    "one electrode from the middle on": "Fit the conditions before and after it apart.",
    "two people under one name": "Give each person a recording of their own.",
    "labels exchanged": "Look at the protocol of the set that is named; exchange its labels.",
    "force filtered alone": _FILTER,
    "position filtered alone": _FILTER,
    "reflex": "Use short disturbances (.15 s) or take the intrinsic part with its own interval.",
    "reflex through a muscle": "Perturb in a wider band; K and K_r together stay sharp.",
    "channels out of step": _LATE,
    "cubic stiffness": _LINEAR,
    "dry friction in the joint": "Take friction out of rig and strap; compare two amplitudes.",
    "K goes up and down": "Use `elbow --time-varying`; K is the mean of the record.",
    "rig imposes the angle": _TORQUE,
    "heavy device, nothing recorded": _TORQUE,
    "own torque": "Ask for a steady contraction, record longer, perturb more strongly.",
    "own torque, nothing recorded": _TORQUE,
    "own torque and a step of K": "Perturb more strongly at low frequencies; repeat the trial.",
    "torque in mNm": _UNITS,
    "torque in kgf m": _UNITS,
    "angle in degrees": _UNITS,
    "gain of the torque": _GAIN,
    "torque's sign": _SIGN,
    "torque clipped": "Use a sensor or an amplifier with more range; leave such trials out.",
    "angle in coarse steps": "Use a finer encoder, or larger motions.",
    "samples lost": _LOST,
    "torque sensor drifts": "Warm the sensor up and zero it; slow drift is projected out.",
    "hum in the torque": "Ground the amplifier; hum above the band does no harm.",
    "every trial twice": _COPIES,
    "crosstalk between the electrodes": "Move the electrodes apart; take what crosstalk allows.",
    "K over EMG is bent": "Fit the law over a smaller range of levels, or one that is bent.",
    "hum in the EMG": "Record the silent muscles; notch the mains before the amplitude is taken.",
    "electrodes slip": "Fix the electrodes, repeat the first level at the end and compare.",
    "muscles' names swapped": "Contract one muscle at a time and see which column answers.",
    "somebody pushes back": "Tell the person not to intervene; use shorter disturbances.",
    "stiffness grows with the way": _LINEAR,
    "dry friction in handle or seat": "Support the arm without friction; compare two speeds.",
    "reaches that never return": "These are movements: `movement` is the command for them.",
    "onsets in the table are off": "Leave the onsets out of the table: they are found.",
    "force in mN": _UNITS,
    "force in kgf": _UNITS,
    "position in mm": _UNITS,
    "position in cm": _UNITS,
    "force's sign": _SIGN,
    "force's sign, one axis": _AXES,
    "force's sign, second condition": _SIGN,
    "force's axes swapped": _AXES,
    "sensor turned": _AXES,
    "one axis of the sensor": _GAIN,
    "force late": _LATE,
    "force clipped": "Use a sensor with more range; leave such trials out.",
    "force in coarse steps": "Use more bits, or a range that fits the force.",
    "force sensor drifts": "Warm the sensor up and zero it; a ramp over a trial is projected out.",
    "hum in the force": "Ground the amplifier; hum above the band does no harm.",
    "handle's mass not told": "Weigh what lies between sensor and hand: `handle_mass_kg`.",
    "gain of the force": _GAIN,
    "disturbance too large": _LINEAR,
    "disturbance does not return": "Any method but `paper` allows for it.",
    "one long trial among many": "Look at the trial that the message names; leave it out.",
    "lengths of the arm": "Measure both lengths from bony landmarks.",
    "shoulder's place": "Measure where the shoulder is in the robot's frame.",
    "lengths in cm": _UNITS,
    "force's gain between the conditions": _GAIN,
    "trials without a frame": "Nothing: they are left out, and listed.",
    "trials with holes": "Look at those that are listed; they are left out.",
    "whose force is not told": "Nothing, where the exam holds the motors' torques: it is found.",
    "whose force is told wrong": "Believe the robot's own inertias, or leave `--force-by` out.",
    "handle is off its link": "Nothing: the offset is fitted, and told.",
    "force in kgf in the file": _UNITS,
    "one trial's file alone": "Put the exam's `common.c3d` beside it.",
    "masses of the limb": _MASS,
    "segment's inertia": "Scale the segment to the person; let the limb swing by gravity alone.",
    "film's rate": "Film a clock, or a ball that falls: gravity must come out as 9.81.",
    "rest angle told": "Leave the rest angle free unless it was measured.",
    "skin moves over the bones": "Put the markers on bone; use more of them.",
    "stiffness is not linear": "Fit the quadratic term (`--quadratic`), or swing less far.",
    "markers lost": "Bridge short gaps only; film from more sides.",
    "markers in mm": _UNITS,
    "limb's weight left in the torque": "Record the limb at rest at several angles, take that off.",
    "limb's inertia left in the torque": "Move slowly, or give masses so that it is taken off.",
    "person does not relax": _RELAX,
    "person helps for .5 s": _RELAX,
    "torque late": _LATE,
    "table of masses": _MASS,
    "plate's place": "Stand a rod on known places: the centre of pressure must be there.",
    "plates' gain": "Stand on the plates: the force must be the weight on a scale.",
    "plates in kgf": _UNITS,
    "plates late": _LATE,
    "plates' frame turned": "Push along the studio's axes and see what the plates answer.",
    "angles in degrees": _UNITS,
    "drawings' masses": "Weigh the links; let the robot fall slowly through its range and compare.",
    "motor torque's gain": "Hang a known weight on the robot: the motor must carry it.",
    "motor torque's sign": _SIGN,
    "motor torque in mNm": _UNITS,
    "motor torque late": _LATE,
    "arm resists motion": "Record lowering too: half the difference is what resists.",
    "muscles are not silent": _RELAX,
    "muscles were not silent": _RELAX,
    "body mass told": _MASS,
    "encoder's zero": "Check the zeros at the mechanical stops before every session.",
    "arm of another body": "Calibrate the arm of the person who is in the robot.",
    "something heavy in the hand": "Nothing in the hand, or calibrate with it.",
    "moment arms of another person": "Use `fit muscles`: it corrects the moment arms.",
    "stiffness saturates": "Fit a higher order, or a smaller range of activation.",
    "crosstalk between muscles": "Move the electrodes apart; single muscles cannot be told.",
    "errors of the activations, not told": "Tell the activations' standard errors.",
    "one condition is wrong": "Look at the condition that the residuals point at.",
    "one posture is wrong": "Look at the posture that the residuals point at.",
    "K in mNm": _UNITS,
    "moment arms are no polynomial": "Use a higher order, or a smaller workspace.",
    "not equally relaxed everywhere": "Record EMG in every posture and fit it too.",
    "standard errors told": "Give those of `estimate`; residuals show what they should be.",
}

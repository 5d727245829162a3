"""Small sound files of OpenSim, as text, to be damaged."""

from __future__ import annotations

import numpy as np

_SAMPLES = 12


def small_trc(markers: int = 3) -> bytes:
    """A .trc of three markers, one of them lost for a while."""
    places = np.random.default_rng(1).uniform(-900, 900, (_SAMPLES, markers, 3)).round(3)
    lines = [
        "PathFileType\t4\t(X/Y/Z)\treach.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame"
        "\tOrigNumFrames",
        f"100\t100\t{_SAMPLES}\t{markers}\tmm\t100\t1\t{_SAMPLES}",
        "Frame#\tTime\t" + "\t\t\t".join(f"marker{i}" for i in range(markers)) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i + 1}" for i in range(markers) for axis in "XYZ"),
        "",
    ]
    for i, row in enumerate(places.reshape(_SAMPLES, -1)):
        cells = [f"{value}" for value in row]
        if i in (3, 4):
            cells[:3] = ["", "nan", ""]
        lines.append("\t".join([f"{i + 1}", f"{i / 100}", *cells]))
    return ("\n".join(lines) + "\n").encode()


def small_mot(header: str = "new") -> bytes:
    """A table of two angles with the new or the older header, or of one angle's states (Vec3)."""
    angles = np.random.default_rng(2).uniform(-60, 60, (_SAMPLES, 6)).round(4)
    width = {"new": 2, "old": 2, "vec3": 6}[header]
    head = {
        "new": f"arm\nversion=1\nnRows={_SAMPLES}\nnColumns=3\ninDegrees=yes\n",
        "old": f"name arm\ndatacolumns 3\ndatarows {_SAMPLES}\nrange 0 0.22\n",
        "vec3": "DataType=Vec3\nversion=3\nOpenSimVersion=4.5\n",
    }[header]
    names = "time\tright_elbow_flexion\tright_shoulder_flexion"
    rows = []
    for i, row in enumerate(angles[:, :width]):
        cells = [f"{v}" for v in row]
        if header == "vec3":
            cells = [",".join(cells[:3]), ",".join(cells[3:])]
        rows.append("\t".join([f"{i / 50}", *cells]))
    return (head + "endheader\n" + "\n".join([names, *rows]) + "\n").encode()

"""Packets in, one line a sample out; what cannot be taken is told and left out."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

from armimpedance.core.errors import ArmImpedanceError
from armimpedance.muscles.live.packets import parsed
from armimpedance.muscles.live.updates import Live

#: So many refusals are told one by one; then every time that their number has doubled.
TOLD: Final = 20


@dataclass
class Served:
    """What a stream has been.

    Attributes
    ----------
    taken, refused : int
        Packets.
    extrapolating, indefinite, flagged : int
        Samples among the taken ones.
    """

    taken: int = 0
    refused: int = 0
    extrapolating: int = 0
    indefinite: int = 0
    flagged: int = 0

    def __str__(self) -> str:
        parts = [f"{self.taken} samples", f"{self.refused} refused"]
        told = {
            "extrapolating": self.extrapolating,
            "not definite": self.indefinite,
            "flagged": self.flagged,
        }
        return ", ".join(parts + [f"{count} {name}" for name, count in told.items() if count])


def serve(
    live: Live,
    packets: Iterable[bytes],
    write: Callable[[str], bool],
    refuse: Callable[[str], object],
) -> Served:
    """Update for each packet and write the result, until there are no more or nobody listens.

    Parameters
    ----------
    live : Live
    packets : iterable of bytes
    write : callable
        Takes a line without its end; False: nobody listens any more.
    refuse : callable
        Told in one line why a packet was not taken.

    Returns
    -------
    Served
    """
    served = Served()
    for packet in packets:
        if not packet.strip():
            continue
        try:
            arguments = parsed(packet, live.signal)
            if arguments is None:
                live.reset()
                continue
            result = live.update(**arguments)
        except ArmImpedanceError as error:
            served.refused += 1
            count = served.refused
            if count <= TOLD or count & (count - 1) == 0:
                refuse(f"packet {served.taken + count} refused ({count} so far): {error}")
            continue
        served.taken += 1
        served.extrapolating += result.extrapolating
        served.indefinite += not result.definite
        served.flagged += bool(result.flags)
        if not write(json.dumps(result.to_dict(), allow_nan=False)):
            break
    return served

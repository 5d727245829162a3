"""One peer on one record, alone in this process: its numbers, its time and its memory.

python child.py MODULE FUNCTION FOLDER OUT.npz
"""

from __future__ import annotations

import importlib
import json
import logging
import re
import sys
import time
import warnings
from pathlib import Path

import numpy as np
from record import load_hand, load_joint


def peak_mb() -> float:
    """The largest memory that this process held since it was started (VmHWM), MB."""
    status = Path("/proc/self/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+)", status)[1]) / 1024


def main(module: str, function: str, folder: str, out: str) -> None:
    """Estimate, keep values and half widths, print the costs of the whole process."""
    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    work = getattr(importlib.import_module(module), function)
    imported = time.process_time()
    load = load_hand if function.startswith("hand") else load_joint
    begun = time.perf_counter()
    values, half = work(load(Path(folder)))
    np.savez(out, values=values, half=half)
    costs = {
        "imports_s": imported,
        "processor_s": time.process_time(),
        "wall_s": time.perf_counter() - begun,
        "peak_mb": peak_mb(),
    }
    print(json.dumps(costs))


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Write a simulated experiment as a recording, with its truth.

Examples:
  armimpedance simulate cocontraction --out session
  armimpedance simulate postures --subject B --noise sensor --seed 7 --out session
  armimpedance simulate force --disturbance biphasic --servo 5000 --out session
  armimpedance simulate cocontraction --as kinarm --out exam      a laboratory's own files
  armimpedance simulate p5 --subject 2 --out relaxed
  armimpedance simulate body --out walking
  armimpedance simulate elbow-varying --subject 3 --frequency-hz 1.5 --out moving
  armimpedance simulate therapy --subject P2 --out patient

`armimpedance simulate RIG --help` lists the options of one experiment. The folder also gets
truth.json, what is known of the simulated subject, and of a robot for therapy drawings.json.
"""

from __future__ import annotations

import argparse


def configure(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command: one subcommand a rig."""
    from armimpedance.lab.parts.simulation import FAMILIES
    from armimpedance.show.command.options import add_parsers

    rigs = add_parsers(parser, "RIG")
    for rig in (rig for family in FAMILIES.values() for rig in family):
        plain = argparse.RawDescriptionHelpFormatter
        sub = rigs.add_parser(rig.name, help=rig.line, description=rig.about, formatter_class=plain)
        sub.set_defaults(prog=sub.prog)
        rig.configure(sub)

"""Forms of a laboratory's files, one file each; `armimpedance.lab.parts.simulation` finds them."""

"""One script per figure of a source, each from simulated subjects, and one that builds them all.

Installed as ``armimpedance_figures``; from a clone, ``python figures/<script>.py --out DIR`` draws
one figure.
"""

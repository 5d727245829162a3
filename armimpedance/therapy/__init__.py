"""The patient's contribution in robot-assisted therapy, after Guidali (2013)."""

"""Departures of a limb from the model: reported if detected, allowed for if not excluded."""

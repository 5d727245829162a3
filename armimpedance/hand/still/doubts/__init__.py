"""Departures of a limb from the model: told where seen, and allowed for where not excluded."""

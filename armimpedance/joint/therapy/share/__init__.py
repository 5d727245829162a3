"""The patient's share in a movement by four formulas, with standard errors."""

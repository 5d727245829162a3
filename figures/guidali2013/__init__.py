"""The figures and tables after Guidali (2013)."""

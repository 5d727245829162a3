"""The figures and tables after Tsuji (1997)."""

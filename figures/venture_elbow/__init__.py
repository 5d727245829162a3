"""The figures and tables after Venture's paper on the elbow."""

"""MATLAB files of all versions as one tree of variables, and its runs of columns."""

"""Methods for I, B and K at an operating point, one file each; `METHOD` is their entry."""

"""Methods for B(t) and K(t), one file each; `METHOD` is their entry."""

"""Formats of recordings, one file each; `armimpedance.recordings.opening` finds them."""

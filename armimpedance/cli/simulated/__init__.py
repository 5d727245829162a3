"""The rigs behind `armimpedance simulate`, one file each."""

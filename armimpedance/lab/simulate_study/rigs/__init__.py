"""The rigs of `armimpedance simulate-study`: one file a rig, with the record RIG."""

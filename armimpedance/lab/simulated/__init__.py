"""The rigs behind `armimpedance simulate`: a family a file, its rigs in the record RIGS."""

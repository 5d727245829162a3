"""Forms of a laboratory's files, one file each; `armimpedance.lab.parts.lab_form` finds them."""

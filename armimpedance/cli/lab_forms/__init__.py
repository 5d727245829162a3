"""Forms of a laboratory's files, one file each; `armimpedance.cli.parts.lab_form` finds them."""

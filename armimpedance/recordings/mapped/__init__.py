"""Tables of any layout with a mapping file: which column is what, in which unit and sign."""

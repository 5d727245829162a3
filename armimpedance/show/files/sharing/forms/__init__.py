"""Forms in which a recording or results can be shared; one file, one form."""

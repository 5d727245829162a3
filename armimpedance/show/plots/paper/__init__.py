"""What a journal asks of a figure: its caption beside it, letters on its panels."""

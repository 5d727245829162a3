"""What all topics show themselves with: files, text, plots, pages, parts of commands."""

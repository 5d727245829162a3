"""The kit of all forms: files, text, plots, pages and parts of commands."""

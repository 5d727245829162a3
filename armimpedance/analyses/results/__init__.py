"""What the verbs return: results found by their names, as tables, files and figures."""

"""Formats of result files, one file each with its record ENDING; nothing else lies here.

The file's name is the ending: ``xlsx.py`` writes ``.xlsx``. Nothing heavy is imported at the top,
because help texts list the endings.
"""

"""Kinarm exams (Dexterit-E) as recordings of the hand."""

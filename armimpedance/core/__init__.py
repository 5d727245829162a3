"""Nouns and rules that all share: records, signs, errors, findings, staged files, workers."""

"""The estimators of passive joints, one file each; its record `METHOD` is the entry."""

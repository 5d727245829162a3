"""Folders of BIDS: motion capture (Motion-BIDS), EMG (EMG-BIDS) and what was recorded beside."""

"""BIDS folders: motion capture (Motion-BIDS), EMG (EMG-BIDS) and other recorded signals."""

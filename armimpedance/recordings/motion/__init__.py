"""Recordings of a moving body: markers, joint motion, force plates, EMG beside them."""

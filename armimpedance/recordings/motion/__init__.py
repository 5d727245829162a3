"""Recordings of a moving body: markers, joint motion, force plates and EMG."""

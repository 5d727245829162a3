"""From markers to joint angles: gaps bridged, a natural posture found by least squares."""

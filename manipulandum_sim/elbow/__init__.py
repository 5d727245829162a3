"""An elbow in a powered exoskeleton, and a bench for one joint."""

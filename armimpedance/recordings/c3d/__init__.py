"""C3D files as they are: any processor, points, analog channels, plates, events."""

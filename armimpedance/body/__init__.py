"""Body dynamics: base parameters from motion and contact forces (Venture, poster)."""

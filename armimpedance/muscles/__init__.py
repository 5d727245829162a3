"""Models of joint impedance: moment arms over posture, muscle stiffness over activation."""

"""Hand -> joint -> muscle: impedance from one level to another, with its covariance."""

"""What the rig imposed on the joint, told or asked of the record, and what then is instrument."""

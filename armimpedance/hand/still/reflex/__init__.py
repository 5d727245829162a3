"""The reflex guard: is the stiffness the limb's own, or partly a late answer of the nerves?"""

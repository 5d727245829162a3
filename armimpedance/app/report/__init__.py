"""A report of whatever it is: the topic is asked for its page."""

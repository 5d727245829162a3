"""What spans the topics: command line, report of whatever it is, study of many people."""

"""Everything that spans the topics: command line, reports, studies of many people."""

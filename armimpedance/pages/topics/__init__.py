"""One file a topic; its record is `TOPIC`."""

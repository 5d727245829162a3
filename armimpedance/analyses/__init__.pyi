from .sources import naming as naming, of_condition as of_condition, read as read

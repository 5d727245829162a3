"""The mathematics that all topics share: signals, regression, criticism of records."""

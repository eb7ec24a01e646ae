"""The command line, one file per command; the pytest plugin; and the names of the previous release."""

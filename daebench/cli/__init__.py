"""The command line, one command a file; the pytest plugin; and the names of the release before."""

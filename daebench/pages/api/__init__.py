"""The reference of the Python interface and of the command line as one page, written from docstrings and from the commands' own help."""

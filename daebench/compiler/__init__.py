"""From a system's symbols and a scheme's file to one compiled module."""

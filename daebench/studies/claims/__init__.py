"""The claims of methods held against measurements."""

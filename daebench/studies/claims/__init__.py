"""The claims of methods, measured."""

"""Methods from outside: a Python callable, a function of a compiled library, or a program in any language."""

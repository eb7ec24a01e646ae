"""Recorded programs as text: of LLVM."""

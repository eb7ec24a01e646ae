"""Figures for print, and SVG panels that answer at once."""

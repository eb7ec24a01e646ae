"""Figures for print, and interactive SVG panels."""

"""Parts of a lesson: controls declared once, and pictures that follow them, live in marimo and as a static page."""

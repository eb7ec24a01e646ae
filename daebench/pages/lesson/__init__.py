"""What a lesson is made of: controls declared once, pictures that follow them, live in marimo and as a static page."""

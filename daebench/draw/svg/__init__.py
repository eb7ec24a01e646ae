"""Interactive pictures: panels of curves as SVG text, for lessons and animations.

Matplotlib draws printed figures (``daebench.draw.figures``). It takes some 300 ms for four panels, but a slider has 200 ms for everything.
The panels here take a few milliseconds and a tenth of the size. They follow the dark mode of the page, and contain the scales of their
axes, so that a script in the page can move their contents.
"""

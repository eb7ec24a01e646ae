"""Pictures that answer at once: panels of curves as SVG text, for lessons and animations.

Matplotlib draws what is printed (``daebench.draw.figures``); four of its panels take some 300 ms, where a slider has 200 ms for everything.
Here they take a few milliseconds, weigh a tenth, follow the page into the dark, and carry the scale of their axes along, so that a
script in the page can move what is in them.
"""

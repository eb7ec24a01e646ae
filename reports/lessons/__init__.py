"""Lessons: the content of their pages (``.py``, ``.html``, ``.js``), and the text of their notebooks (``.md``)."""

"""Lessons: what each puts into its page (``.py``, ``.html``, ``.js``), and the text of its notebook (``.md``)."""

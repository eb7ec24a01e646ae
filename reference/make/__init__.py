"""How a certified reference is made."""

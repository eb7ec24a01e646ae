"""How references are verified, and results held against them."""

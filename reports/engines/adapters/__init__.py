"""Adapters: one file an engine, which poses motions in the engine's own words and maps its coordinates to daebench's q and p."""

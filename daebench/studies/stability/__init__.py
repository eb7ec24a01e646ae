"""Where methods break: step sizes, parameters, penalties and round-off."""

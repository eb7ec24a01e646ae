"""Methods driven to where they break: step sizes, parameters, penalties and round-off."""

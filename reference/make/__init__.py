"""Making of certified references."""

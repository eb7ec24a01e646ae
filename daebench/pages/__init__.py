"""Reports, lessons, animations and documentation, as pages."""

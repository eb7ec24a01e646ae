"""The effect of precision: single, double and compensated arithmetic."""

"""What precision buys: single, double and compensated arithmetic."""

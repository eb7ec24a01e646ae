"""Programs on numbers: functions are run on values that record what is done with them."""

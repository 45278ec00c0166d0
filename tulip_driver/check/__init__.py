"""The contract's test kit: whether a body does what every driver must, from the first reading to the stop."""

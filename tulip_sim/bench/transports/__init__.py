"""What bench `transport` measures: nodes that are killed and started again, and pictures between two nodes."""

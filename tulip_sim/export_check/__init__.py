"""Exported files, loaded by the programs that they are for, beside the robot that they came from."""

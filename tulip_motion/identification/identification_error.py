"""The refusal that all of the identification shares."""


class IdentificationError(ValueError):
    """Measurements cannot be used; the message says why, and what to do."""

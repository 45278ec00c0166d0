"""The report of one recording: what happened, as a page, a PDF and pictures."""

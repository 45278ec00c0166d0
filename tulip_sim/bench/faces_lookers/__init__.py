"""Programs that look at a robot by its faces, as people do, so that bench `faces` can measure what that costs."""

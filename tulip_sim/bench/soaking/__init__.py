"""Parts of the bench `soak`: what a process holds, how that is kept, and whether it grows."""

"""Every reader of what comes from outside, and inputs that are nearly what it expects; docs/security.md.

- mutation.py: damages bytes and texts;
- samples.py: whole inputs to be damaged;
- inputs.py: each kind of input, how it is read, and with which errors it may be refused;
- campaign.py: reads many of them in a process of its own, which may die, hang or want too much memory;
- bench.py: `bench.py fuzz`.
"""

"""A body behind bytes: CAN-like frames over UDP or a serial line, docs/wire.md. To copy for one's own robot."""

"""The bridge to Foxglove and viewers like it: all topics, the menu's services and parameters over a WebSocket."""

"""The scene thread and what it publishes: `scene_thread`, `browser_views`, `state_feed`."""

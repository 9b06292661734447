"""Live views in other programs: `live_robot` receives, the Foxglove and Rerun modules show."""

"""Meshes of furniture and household objects."""

"""Rooms of a home and their types, inferred from the map: `room_inference.infer_rooms`.

Types of room name places for people; the levels of common objects do not depend on them.
"""

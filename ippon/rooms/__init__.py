"""Room types of a home, inferred from the map; the entry is `room_inference.infer_rooms`.

Room types name places for people; the levels of common objects do not depend on them.
"""

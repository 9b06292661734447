"""What a sentence asks for: objects, attributes, relations, counts."""

"""The processes of the product."""

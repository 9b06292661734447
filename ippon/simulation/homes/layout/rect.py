"""Axis-aligned rectangles on the floor."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Rect:
    """x0 <= x <= x1, y0 <= y <= y1, metres."""

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def width(self) -> float:
        """Extent along x."""
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        """Extent along y."""
        return self.y1 - self.y0

    @property
    def area(self) -> float:
        """Square metres."""
        return self.width * self.depth

    @property
    def center(self) -> tuple[float, float]:
        """Centre (x, y)."""
        return 0.5 * (self.x0 + self.x1), 0.5 * (self.y0 + self.y1)

    def grown(self, margin: float) -> "Rect":
        """Return the rectangle enlarged by `margin` on every side; negative shrinks it."""
        return Rect(self.x0 - margin, self.y0 - margin, self.x1 + margin, self.y1 + margin)

    def clipped(self, other: "Rect") -> "Rect":
        """Return the intersection with `other`; its area is 0 if they are apart."""
        x0, y0 = min(max(self.x0, other.x0), other.x1), min(max(self.y0, other.y0), other.y1)
        x1, y1 = max(min(self.x1, other.x1), x0), max(min(self.y1, other.y1), y0)
        return Rect(x0, y0, x1, y1)

    def overlaps(self, other: "Rect", slack: float = 1e-6) -> bool:
        """Tell whether the two share an area; touching edges do not count."""
        return (
            self.x0 < other.x1 - slack
            and other.x0 < self.x1 - slack
            and self.y0 < other.y1 - slack
            and other.y0 < self.y1 - slack
        )

    def contains(self, other: "Rect", slack: float = 1e-6) -> bool:
        """Tell whether `other` lies within."""
        return (
            self.x0 <= other.x0 + slack
            and self.y0 <= other.y0 + slack
            and other.x1 <= self.x1 + slack
            and other.y1 <= self.y1 + slack
        )

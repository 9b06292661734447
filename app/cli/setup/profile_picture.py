"""A robot's profile as a picture: body and field of view."""

import math
from typing import Final

from PIL import Image, ImageDraw, ImageFont

from ippon.robot import RobotProfile

_WIDTH: Final = 1100
_HEADING: Final = 34
_BEHIND_M: Final = 0.8
_BELOW_M: Final = 0.15
_STEPS: Final = 24
_INK: Final = (32, 33, 36)
_BODY: Final = (86, 180, 233)
_VIEW: Final = (230, 159, 0)
_GRID: Final = (225, 227, 230)
Point = tuple[float, float]


def draw_profile(profile: RobotProfile) -> Image.Image:
    """Draw body and field of view from the side and from above, with a line per metre."""
    behind_m = min(-_BEHIND_M, *(s.x_m - s.radius_m for s in profile.spheres)) - 0.1
    ahead_m = max(
        profile.camera_forward_m + profile.max_depth_m,
        *(s.x_m + s.radius_m for s in profile.spheres),
    )
    frame = _WIDTH / (ahead_m + 0.1 - behind_m), behind_m
    parts = [_side(profile, frame), _above(profile, frame)]
    texts = [
        f"{profile.name} from the side, its camera tilted lowest and highest"
        if profile.can_tilt
        else f"{profile.name} from the side",
        "from above; a line for each metre",
    ]
    image = Image.new("RGB", (_WIDTH, sum(p.height + _HEADING for p in parts)), "white")
    draw, font = ImageDraw.Draw(image), ImageFont.load_default(size=18)
    y = 0
    for part, text in zip(parts, texts, strict=True):
        draw.text((12, y + 7), text, fill=_INK, font=font)
        image.paste(part, (0, y + _HEADING))
        y += part.height + _HEADING
    return image


class _Sheet:
    """A drawing in metres: x ahead of the base, y up."""

    def __init__(self, frame: Point, low_m: float, high_m: float) -> None:
        """Create a drawing from pixels per metre, the left end, and the ends along y in metres."""
        scale, left_m = frame
        self.image = Image.new("RGB", (_WIDTH, round((high_m - low_m) * scale)), "white")
        self._draw = ImageDraw.Draw(self.image, "RGBA")
        self._scale, self._left_m, self._high_m = scale, left_m, high_m
        for k in range(math.ceil(left_m), 1 + int(left_m + _WIDTH / scale)):
            self.line((k, low_m), (k, high_m), _GRID, 1)

    def _at(self, point: Point) -> Point:
        return (point[0] - self._left_m) * self._scale, (self._high_m - point[1]) * self._scale

    def line(self, start: Point, end: Point, colour: tuple[int, ...], width: int) -> None:
        self._draw.line([self._at(start), self._at(end)], fill=colour, width=width)

    def area(self, points: list[Point]) -> None:
        self._draw.polygon([self._at(p) for p in points], fill=(*_VIEW, 60), outline=_VIEW)

    def ball(self, x: float, y: float, radius: float, *, body: bool) -> None:
        (u, v), r = self._at((x, y)), radius * self._scale
        fill, outline = ((*_BODY, 80), _BODY) if body else (None, _INK)
        self._draw.ellipse([u - r, v - r, u + r, v + r], fill=fill, outline=outline, width=2)


def _side(profile: RobotProfile, frame: Point) -> Image.Image:
    top = max(profile.camera_height_m, profile.height_m)
    sheet = _Sheet(frame, -_BELOW_M, max(2.2, top + 0.5))
    x, z = profile.camera_forward_m, profile.camera_height_m
    half = 0.5 * profile.vertical_fov_rad
    for tilt in dict.fromkeys((profile.min_tilt_rad, profile.max_tilt_rad)):
        points = [(x, z)]
        for step in range(_STEPS + 1):
            angle = tilt + half * (2.0 * step / _STEPS - 1.0)
            reach = profile.max_depth_m
            if angle < 0.0:
                reach = min(reach, z / math.sin(-angle))
            points.append((x + reach * math.cos(angle), z + reach * math.sin(angle)))
        sheet.area(points)
    for s in profile.spheres:
        sheet.ball(s.x_m, s.z_m, s.radius_m, body=True)
    sheet.line((frame[1], 0.0), (frame[1] + _WIDTH / frame[0], 0.0), _INK, 2)
    sheet.ball(x, z, 0.02, body=False)
    return sheet.image


def _above(profile: RobotProfile, frame: Point) -> Image.Image:
    half = 0.5 * profile.horizontal_fov_rad
    aside_m = profile.max_depth_m * math.sin(min(half, 0.5 * math.pi))
    side = max(profile.radius_m, aside_m) + 0.1
    sheet = _Sheet(frame, -side, side)
    x, reach = profile.camera_forward_m, profile.max_depth_m
    angles = [half * (2.0 * step / _STEPS - 1.0) for step in range(_STEPS + 1)]
    sheet.area([(x, 0.0), *((x + reach * math.cos(a), reach * math.sin(a)) for a in angles)])
    for s in profile.spheres:
        sheet.ball(s.x_m, s.y_m, s.radius_m, body=True)
    sheet.ball(0.0, 0.0, profile.radius_m, body=False)
    sheet.ball(x, 0.0, 0.02, body=False)
    return sheet.image

// Where the plan fits beside what lies over it, and where its rooms' names are apart from each other.
// Areas and boxes are [left, top, right, bottom] in pixels of the plan.

const APART_PX = 3;
const LEAST_PX = 100;
const TRIES = [[0, 0], [0, -1], [0, 1], [0, -2], [0, 2], [-1, 0], [1, 0], [-1, -1], [1, -1], [-1, 1], [1, 1]];

export const meets = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];

// The area in which a map is largest that is free of all boxes, the whole one if too little is left.
export function freeArea(whole, boxes, scaleIn) {
  let areas = [whole];
  for (const box of boxes) {
    areas = areas.flatMap((area) => (meets(area, box) ? around(area, box) : [area]));
  }
  const isRoomy = ([left, top, right, bottom]) => right - left >= LEAST_PX && bottom - top >= LEAST_PX;
  const roomy = areas.filter(isRoomy).sort((a, b) => scaleIn(b) - scaleIn(a));
  return roomy[0] ?? whole;
}

// What is left of an area on each side of a box.
function around([left, top, right, bottom], box) {
  return [
    [left, top, Math.min(right, box[0]), bottom],
    [Math.max(left, box[2]), top, right, bottom],
    [left, top, right, Math.min(bottom, box[1])],
    [left, Math.max(top, box[3]), right, bottom],
  ];
}

// Boxes that do not meet, as far as there is room: each where it was or close by, the first ones first.
export function apart(boxes) {
  const placed = [];
  for (const box of boxes) placed.push(freeBox(box, placed));
  return placed;
}

function freeBox(box, placed) {
  const [wide, high] = [box[2] - box[0] + APART_PX, box[3] - box[1] + APART_PX];
  const tries = TRIES.map(([x, y]) => [x * wide, y * high]).map(([x, y]) => moved(box, x, y));
  return tries.find((one) => !placed.some((other) => meets(one, other))) ?? box;
}

const moved = ([left, top, right, bottom], x, y) => [left + x, top + y, right + x, bottom + y];

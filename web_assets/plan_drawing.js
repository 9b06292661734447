// Draws the plan: cells, painted floor, trail, path, robot, names and scale, in metres of the world.

import { meets } from "./plan_layout.js";
import { nameOf } from "./words.js";

export const COLORS = {
  unknown: "#2a313b", floor: "#f2efe8", furniture: "#c9b89c", wall: "#151920",
  robot: "#1f7fb8", path: "#b58900", trail: "#56b4e9", find: "#00805d", text: "#1a2129",
};
const CELLS = [[42, 49, 59, 255], [242, 239, 232, 255], [201, 184, 156, 255], [21, 25, 32, 255]];

// Unpacks four cells per byte into an image, north up.
export function cellImage({ size: [width, height], packed }) {
  const bytes = Uint8Array.from(atob(packed), (c) => c.charCodeAt(0));
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d");
  const image = context.createImageData(width, height);
  for (let i = 0; i < width; i += 1) {
    for (let j = 0; j < height; j += 1) {
      const at = i * height + j;
      const cell = (bytes[at >> 2] >> (2 * (at & 3))) & 3;
      image.data.set(CELLS[cell], 4 * ((height - 1 - j) * width + i));
    }
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

export function scaleBar(metresAcross) {
  const limit = Math.max(metresAcross / 5, 0.1);
  const power = 10 ** Math.floor(Math.log10(limit));
  return [5, 2, 1].map((step) => step * power).find((step) => step <= limit);
}

// place: world to pixels; scale: pixels per metre; isSmall: without names, for the corner; taken: boxes
// of the rooms' names.
export function drawPlan(context, { cells, image, scene, place, scale, isSmall, taken }) {
  context.imageSmoothingEnabled = false;
  const [x0, y0] = cells.origin_m;
  const [wide, high] = cells.size.map((n) => n * cells.cell_m);
  context.drawImage(image, ...place(x0, y0 + high), wide * scale, high * scale);
  if (!scene) return;
  for (const { kind, strokes, radius_m } of scene.painted) {
    context.fillStyle = kind === "look_here" ? "rgb(213 94 0 / 28%)" : "rgb(0 114 178 / 28%)";
    area(context, strokes.map((p) => place(...p)), radius_m * scale);
  }
  line(context, scene.trail.map((p) => place(...p)), COLORS.trail, 2);
  line(context, scene.path.map((p) => place(...p)), COLORS.path, 3.5);
  if (scene.find) {
    context.strokeStyle = COLORS.find;
    context.lineWidth = 3;
    context.beginPath();
    context.arc(...place(scene.find[0], scene.find[1]), Math.max(8, 0.25 * scale), 0, 7);
    context.stroke();
  }
  if (scene.robot) robot(context, scene.robot, place, Math.max(7, 0.25 * scale));
  if (!isSmall) names(context, scene, place, scale, taken);
}

// Discs that overlap are one area of one tone.
function area(context, points, radius) {
  context.beginPath();
  for (const [u, v] of points) {
    context.moveTo(u + radius, v);
    context.arc(u, v, radius, 0, 7);
  }
  context.fill();
}

function disc(context, [u, v], radius) {
  context.beginPath();
  context.arc(u, v, radius, 0, 7);
  context.fill();
}

function line(context, points, color, width) {
  if (points.length < 2) return;
  context.strokeStyle = color;
  context.lineWidth = width;
  context.lineJoin = "round";
  context.beginPath();
  for (const [n, point] of points.entries()) context[n ? "lineTo" : "moveTo"](...point);
  context.stroke();
}

function robot(context, [x, y, yaw], place, radius) {
  const [u, v] = place(x, y);
  context.fillStyle = COLORS.robot;
  disc(context, [u, v], radius);
  context.fillStyle = "#fff";
  context.beginPath();
  for (const [turn, reach] of [[0, 0.85], [2.5, 0.6], [-2.5, 0.6]]) {
    context.lineTo(
      u + radius * reach * Math.cos(yaw + turn), v - radius * reach * Math.sin(yaw + turn),
    );
  }
  context.fill();
}

// Names of furniture that meet neither each other, the rooms' names nor the robot, the largest first.
function names(context, scene, place, scale, rooms) {
  context.font = "12px system-ui, sans-serif";
  context.textAlign = "center";
  context.textBaseline = "middle";
  const taken = [...rooms];
  if (scene.robot) {
    const [u, v] = place(scene.robot[0], scene.robot[1]);
    const reach = Math.max(7, 0.25 * scale);
    taken.push([u - reach, v - reach, u + reach, v + reach]);
  }
  for (const thing of scene.things) {
    const text = nameOf(thing.text);
    const wide = context.measureText(text).width / 2 + 3;
    const [u, v] = place(thing.x_m, thing.y_m);
    const box = [u - wide, v - 9, u + wide, v + 9];
    if (wide > 1.4 * Math.max(thing.size_x_m, thing.size_y_m, 0.6) * scale) continue;
    if (taken.some((other) => meets(box, other))) continue;
    taken.push(box);
    context.lineWidth = 3;
    context.strokeStyle = "rgb(255 255 255 / 80%)";
    context.strokeText(text, u, v);
    context.fillStyle = COLORS.text;
    context.fillText(text, u, v);
  }
}

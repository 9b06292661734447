// The path of this robot's page, "/" for the console's own robot, and what is fetched below it.

const scene = document.getElementById("view").getAttribute("src");
// A robot's own name may end in "view".
export const BASE = scene.slice(0, scene.lastIndexOf("view/"));

const LIMIT_MS = 15000;

// Fetches what a page asks for again and again: on a dead line a request would wait for minutes.
export const get = (path) => fetch(path, { signal: AbortSignal.timeout(LIMIT_MS) });

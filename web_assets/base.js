// The path of this robot's page, "/" for the console's own robot, and what is fetched below it.

export const BASE = document.getElementById("view").getAttribute("src").split("view/")[0];

const LIMIT_MS = 15000;

// Fetches what a page asks for again and again: on a dead line a request would wait for minutes.
export const get = (path) => fetch(path, { signal: AbortSignal.timeout(LIMIT_MS) });

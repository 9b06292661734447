// Receives and draws the camera's pictures in a thread of its own, so that a slow map does not delay them.

const RETRY_MS = 1000;
const COLORS = {
  find: "#00c48f", hidden: "#00c48f", candidate: "#e69f00", way: "#f0e442", edge: "#f0e442", stop: "#ff6a1f",
  slow: "#e69f00", seen: "#56b4e9",
};
const WIDTHS = { find: 3, hidden: 1.5, candidate: 2, way: 3, edge: 1.5, stop: 3.5, slow: 2.5, seen: 2 };
const DASHES = { hidden: [3, 6], candidate: [6, 4], edge: [8, 6], slow: [10, 6] };

let canvas = null;
let words = {};
let context = null;
let socket = null;
let address = "";
let retry = 0;
let wish = { longest_px: 0, label: null };
let size = { width: 1, height: 1, scale: 1 };
let newest = -1; // Number of the newest picture of this connection that is decoded.
let next = null;
let shown = null;

onmessage = ({ data }) => {
  if (data.canvas) {
    canvas = data.canvas;
    words = data.words;
    context = canvas.getContext("2d", { alpha: false });
    address = data.url;
    connect();
  } else if (data.reconnect) {
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.close();
    connect();
  } else if (data.size) {
    size = data.size;
    draw();
  } else if (data.wish) {
    wish = data.wish;
    sendWish();
  }
};

function connect() {
  clearTimeout(retry);
  newest = -1;
  socket = new WebSocket(address);
  socket.binaryType = "arraybuffer";
  socket.onopen = sendWish;
  socket.onmessage = ({ data }) => {
    if (typeof data === "string") postMessage({ latency: JSON.parse(data) });
    else receive(data);
  };
  socket.onclose = () => {
    postMessage({ closed: true });
    retry = setTimeout(connect, RETRY_MS);
  };
}

function send(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function sendWish() {
  send({ type: "show", ...wish });
}

async function receive(data) {
  const cameAt = Date.now();
  const length = new DataView(data).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  const jpeg = new Blob([new Uint8Array(data, 4 + length)], { type: "image/jpeg" });
  let bitmap;
  try {
    bitmap = await createImageBitmap(jpeg);
  } catch {
    send({ type: "drawn", number: header.number });
    return;
  }
  const picture = { header, bitmap, bytes: data.byteLength, cameAt };
  // Decoding a small picture may overtake that of a larger one before it.
  if (header.number < newest) {
    drop(picture);
    return;
  }
  newest = header.number;
  if (next === null) requestAnimationFrame(show);
  else drop(next);
  next = picture;
}

// A newer picture has come before this one was drawn.
function drop({ header, bitmap }) {
  bitmap.close();
  send({ type: "drawn", number: header.number });
}

function show() {
  shown?.bitmap.close();
  shown = next;
  next = null;
  draw();
  const { header, bitmap, bytes, cameAt } = shown;
  send({ type: "drawn", number: header.number });
  const drawnAt = Date.now();
  // A page that is hidden draws nothing: a picture that came then waits until it is seen.
  postMessage({ header, shape: bitmap.width / bitmap.height, bytes, drawnAt, waited_ms: drawnAt - cameAt });
}

function draw() {
  if (context === null) return;
  const width = Math.max(1, Math.round(size.width * size.scale));
  const height = Math.max(1, Math.round(size.height * size.scale));
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  context.fillStyle = "#0d1117";
  context.fillRect(0, 0, width, height);
  if (shown === null) return;
  const { bitmap, header } = shown;
  const share = Math.min(width / bitmap.width, height / bitmap.height);
  const w = bitmap.width * share;
  const h = bitmap.height * share;
  const left = (width - w) / 2;
  const top = (height - h) / 2;
  context.imageSmoothingQuality = "high";
  context.drawImage(bitmap, left, top, w, h);
  context.save();
  context.beginPath();
  context.rect(left, top, w, h);
  context.clip();
  for (const line of header.lines) stroke(line, (x, y) => [left + x * w, top + y * h]);
  for (const line of header.lines) write(line, (x, y) => [left + x * w, top + y * h], left + w, top);
  context.restore();
}

function stroke({ kind, points }, place) {
  context.beginPath();
  for (const [n, [x, y]] of points.entries()) context[n ? "lineTo" : "moveTo"](...place(x, y));
  context.lineJoin = context.lineCap = "round";
  // A dark rim keeps lines visible on a bright picture.
  context.setLineDash([]);
  context.strokeStyle = "rgb(0 0 0 / 55%)";
  context.lineWidth = (WIDTHS[kind] + 2) * size.scale;
  if (!DASHES[kind]) context.stroke();
  context.setLineDash((DASHES[kind] ?? []).map((dash) => dash * size.scale));
  context.strokeStyle = COLORS[kind];
  context.lineWidth = WIDTHS[kind] * size.scale;
  context.stroke();
}

function write({ kind, points, text }, place, right, top) {
  const named = text || words[kind];
  if (!named || size.width < 260) return;
  const font = 13 * size.scale;
  context.font = `600 ${font}px system-ui, sans-serif`;
  const isLimit = kind === "stop" || kind === "slow";
  const anchor = isLimit
    ? points[points.length >> 1]
    : points.reduce((best, point) => (point[1] < best[1] ? point : best));
  const wide = context.measureText(named).width;
  let [x, y] = place(...anchor);
  x = Math.min(Math.max(x - wide / 2, 4), right - wide - 4);
  y = Math.max(y - 6 * size.scale, top + font + 2);
  context.fillStyle = "rgb(0 0 0 / 65%)";
  context.fillRect(x - 4, y - font, wide + 8, font * 1.35);
  context.fillStyle = COLORS[kind];
  context.fillText(named, x, y);
}

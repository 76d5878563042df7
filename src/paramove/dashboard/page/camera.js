// The camera's image with what is tracked in it, and the calibrated plane as a grid.
import { colourOf, css } from "./colours.js";

const GRID_M = 0.02;

export class CameraView {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.bitmap = null;
    this.tall = 36; // px of the image
    this.arrived = 0; // counts images drawn
    this.arrivedAt = -Infinity;
    this.state = { tracked: {}, plane: {}, objects: {}, pointed: "", arm: {} };
  }

  async image(bytes) {
    let bitmap;
    try {
      bitmap = await createImageBitmap(new Blob([bytes], { type: "image/jpeg" }));
    } catch {
      return; // a damaged image is left out; the next one follows
    }
    this.bitmap?.close();
    this.bitmap = bitmap;
    this.arrived += 1;
    this.arrivedAt = performance.now();
  }

  update(state) {
    Object.assign(this.state, state);
  }

  draw() {
    const { canvas, context: c, bitmap } = this;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    if (!bitmap) return;
    const scale = Math.min(width / bitmap.width, height / bitmap.height);
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.fillStyle = "#000";
    c.fillRect(0, 0, width, height);
    c.setTransform(scale, 0, 0, scale, (width - scale * bitmap.width) / 2, (height - scale * bitmap.height) / 2);
    c.drawImage(bitmap, 0, 0);
    this.unit = ratio / scale; // one CSS pixel, in pixels of the image
    this.grid();
    for (const item of this.state.tracked.items ?? []) item.hand ? this.hand(item) : this.object(item);
    this.arm();
  }

  arm() { // of a tracked person, and the ball where it points
    const { lines = [], balls = [] } = this.state.arm, c = this.context, u = this.unit;
    for (const { points, closed, colour } of lines) {
      c.beginPath();
      points.forEach((point, index) => (index ? c.lineTo(...point) : c.moveTo(...point)));
      if (closed) c.closePath();
      c.strokeStyle = colour; c.lineWidth = 2 * u; c.stroke();
    }
    for (const { place, diameter, colour } of balls) {
      c.beginPath(); c.arc(...place, diameter / 2, 0, 7);
      c.fillStyle = colour; c.fill();
      c.strokeStyle = "#000"; c.lineWidth = u; c.stroke();
    }
  }

  grid() {
    const { plane, objects } = this.state, c = this.context, u = this.unit;
    if (!plane.corners?.length) return;
    const seen = inverse(plane.plane_from_image);
    const at = (x, y) => {
      const [a, b, w] = seen.map((row) => row[0] * x + row[1] * y + row[2]);
      return [a / w, b / w];
    };
    const xs = plane.corners.map((corner) => corner[2]), ys = plane.corners.map((corner) => corner[3]);
    const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const line = (from, to, strong) => {
      c.beginPath(); c.moveTo(...at(...from)); c.lineTo(...at(...to));
      c.strokeStyle = strong ? "rgb(56 189 248 / .95)" : "rgb(56 189 248 / .38)";
      c.lineWidth = (strong ? 1.8 : 1) * u; c.stroke();
    };
    for (let x = Math.ceil(x0 / GRID_M) * GRID_M; x < x1; x += GRID_M) line([x, y0], [x, y1], false);
    for (let y = Math.ceil(y0 / GRID_M) * GRID_M; y < y1; y += GRID_M) line([x0, y], [x1, y], false);
    for (const [a, b] of [[[x0, y0], [x1, y0]], [[x1, y0], [x1, y1]], [[x1, y1], [x0, y1]], [[x0, y1], [x0, y0]]]) line(a, b, true);
    // The plane is that of the objects' middles; an opening lies half an object lower, as tall as objects look here.
    for (const item of this.state.tracked.items ?? []) if (!item.hand) this.tall += 0.1 * (item.box[3] - this.tall);
    for (const [name, object] of Object.entries(objects)) {
      if (!object.rule) continue;
      const [px, py] = at(...object.rule.place).map((value, index) => value + index * 0.4 * this.tall);
      c.beginPath(); c.arc(px, py, 6 * u, 0, 7);
      c.fillStyle = css(colourOf(name), 0.35); c.fill();
      c.strokeStyle = "#fff"; c.lineWidth = 3.6 * u; c.stroke();
      c.strokeStyle = css(colourOf(name)); c.lineWidth = 2 * u; c.stroke();
    }
  }

  object(item) {
    const c = this.context, u = this.unit, pointed = item.name === this.state.pointed, margin = 3 * u;
    const [left, top, width, height] = item.box;
    c.beginPath();
    c.roundRect(left - margin, top - margin, width + 2 * margin, height + 2 * margin, 4 * u);
    c.strokeStyle = "rgb(0 0 0 / .55)"; c.lineWidth = (pointed ? 7 : 4) * u; c.stroke();
    c.strokeStyle = pointed ? "#fff" : css(colourOf(item.name)); c.lineWidth = (pointed ? 4 : 2) * u; c.stroke();
    this.label(left + width / 2, top - margin - 4 * u, pointed ? `${item.name}: pointed at` : item.name, css(colourOf(item.name)));
  }

  hand(item) {
    const c = this.context, u = this.unit;
    if (item.outline.length > 2) {
      c.beginPath();
      item.outline.forEach((point, index) => (index ? c.lineTo(...point) : c.moveTo(...point)));
      c.closePath();
      c.fillStyle = "rgb(244 114 182 / .14)"; c.fill();
      c.strokeStyle = "rgb(244 114 182)"; c.lineWidth = 2 * u; c.setLineDash([5 * u, 4 * u]); c.stroke(); c.setLineDash([]);
    }
    const [left, top, width] = item.box;
    this.label(left + width / 2, top - 6 * u, "hand", "rgb(244 114 182)");
  }

  label(x, bottom, text, colour) {
    const c = this.context, u = this.unit;
    c.font = `600 ${12 * u}px system-ui, "DejaVu Sans", sans-serif`;
    const width = c.measureText(text).width + 12 * u, height = 17 * u;
    const left = Math.min(Math.max(x - width / 2, 2 * u), this.bitmap.width - width - 2 * u), top = Math.max(bottom - height, 2 * u);
    c.beginPath(); c.roundRect(left, top, width, height, 5 * u);
    c.fillStyle = "rgb(10 14 18 / .78)"; c.fill();
    c.fillStyle = colour; c.fillRect(left + 5 * u, top + height - 3.4 * u, width - 10 * u, 1.6 * u);
    c.fillStyle = "#fff"; c.textBaseline = "middle"; c.fillText(text, left + 6 * u, top + height / 2 - u);
  }
}

function inverse(m) {
  const cofactor = (r, c) => {
    const [a, b] = [0, 1, 2].filter((i) => i !== r), [d, e] = [0, 1, 2].filter((i) => i !== c);
    return ((r + c) % 2 ? -1 : 1) * (m[a][d] * m[b][e] - m[a][e] * m[b][d]);
  };
  const determinant = [0, 1, 2].reduce((sum, c) => sum + m[0][c] * cofactor(0, c), 0);
  return [0, 1, 2].map((r) => [0, 1, 2].map((c) => cofactor(c, r) / determinant));
}

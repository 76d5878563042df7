// Triangles of unit shapes, and the few matrices that a view of them needs. Column-major, as WebGL has them.

function grid(columns, rows, at) {
  const positions = [], normals = [], indices = [];
  for (let r = 0; r <= rows; r++) for (let c = 0; c <= columns; c++) {
    const [p, n] = at(c / columns, r / rows);
    positions.push(...p); normals.push(...n);
  }
  for (let r = 0; r < rows; r++) for (let c = 0; c < columns; c++) {
    const a = r * (columns + 1) + c, b = a + columns + 1;
    indices.push(a, a + 1, b, b, a + 1, b + 1);
  }
  return { positions, normals, indices };
}

function joined(...parts) {
  const all = { positions: [], normals: [], indices: [] };
  for (const part of parts) {
    const offset = all.positions.length / 3;
    all.positions.push(...part.positions); all.normals.push(...part.normals);
    all.indices.push(...part.indices.map((index) => index + offset));
  }
  return all;
}

const disc = (z, inner = 0, count = 32) => grid(count, 1, (u, v) => {
  const radius = inner + (1 - inner) * v, angle = 2 * Math.PI * u;
  return [[radius * Math.cos(angle), radius * Math.sin(angle), z], [0, 0, Math.sign(z) || 1]];
});

export const SHAPES = {
  box: joined(...[[0, 1, 2], [1, 2, 0], [2, 0, 1]].flatMap(([i, j, k]) => [-1, 1].map((side) => grid(1, 1, (u, v) => {
    const p = [0, 0, 0], n = [0, 0, 0];
    p[i] = 2 * u - 1; p[j] = 2 * v - 1; p[k] = side; n[k] = side;
    return [p, n];
  })))),
  sphere: grid(28, 18, (u, v) => {
    const a = 2 * Math.PI * u, b = Math.PI * v, p = [Math.sin(b) * Math.cos(a), Math.sin(b) * Math.sin(a), Math.cos(b)];
    return [p, p];
  }),
  tube: grid(28, 1, (u, v) => {
    const a = 2 * Math.PI * u, n = [Math.cos(a), Math.sin(a), 0];
    return [[n[0], n[1], 2 * v - 1], n];
  }),
  disc: disc(0),
  ring: disc(0, 0.72),
};
SHAPES.cylinder = joined(SHAPES.tube, disc(1), disc(-1));

export function multiply(a, b) {
  const m = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) {
    for (let k = 0; k < 4; k++) m[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  }
  return m;
}

export function rigid([x, y, z], [w, i, j, k]) {
  return new Float32Array([
    1 - 2 * (j * j + k * k), 2 * (i * j + k * w), 2 * (i * k - j * w), 0,
    2 * (i * j - k * w), 1 - 2 * (i * i + k * k), 2 * (j * k + i * w), 0,
    2 * (i * k + j * w), 2 * (j * k - i * w), 1 - 2 * (i * i + j * j), 0,
    x, y, z, 1,
  ]);
}

export function moved(x, y, z) {
  return rigid([x, y, z], [1, 0, 0, 0]);
}

export function scaled(x, y, z) {
  return new Float32Array([x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1]);
}

export function perspective(fovy, aspect, near, far) {
  const f = 1 / Math.tan(fovy / 2);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0]);
}

export function lookAt(eye, target) {
  const minus = (a, b) => a.map((value, index) => value - b[index]);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (a) => { const length = Math.hypot(...a) || 1; return a.map((value) => value / length); };
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const back = unit(minus(eye, target)), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
  return new Float32Array([
    right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
  ]);
}

// Where the bodies of a movie are at a moment, and how far they get: flat arrays of numbers, nothing of the picture.
"use strict";

const WORLD_BODY = -1;

// --- arithmetic on flat arrays: no object is made while a scene moves ---
function turnInto(out, q, x, y, z) {
  const [w, a, b, c] = q;
  const tx = 2 * (b * z - c * y), ty = 2 * (c * x - a * z), tz = 2 * (a * y - b * x);
  out[0] = x + w * tx + b * tz - c * ty;
  out[1] = y + w * ty + c * tx - a * tz;
  out[2] = z + w * tz + a * ty - b * tx;
}

function product(p, q) {
  const [a, b, c, d] = p, [w, x, y, z] = q;
  return [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w];
}

// Column-major matrix of a unit quaternion, scaled and placed, written at `at`.
function placeInto(out, at, p, q, sx, sy, sz) {
  const [w, x, y, z] = q;
  out[at] = sx * (1 - 2 * (y * y + z * z)); out[at + 1] = sx * 2 * (x * y + w * z); out[at + 2] = sx * 2 * (x * z - w * y); out[at + 3] = 0;
  out[at + 4] = sy * 2 * (x * y - w * z); out[at + 5] = sy * (1 - 2 * (x * x + z * z)); out[at + 6] = sy * 2 * (y * z + w * x); out[at + 7] = 0;
  out[at + 8] = sz * 2 * (x * z + w * y); out[at + 9] = sz * 2 * (y * z - w * x); out[at + 10] = sz * (1 - 2 * (x * x + y * y)); out[at + 11] = 0;
  out[at + 12] = p[0]; out[at + 13] = p[1]; out[at + 14] = p[2]; out[at + 15] = 1;
}

// The shortest turn of the z-axis onto a direction of the given length.
function aim(dx, dy, dz, length) {
  const w = 1 + dz / length;
  if (w < 1e-9) { return [0, 1, 0, 0]; }
  const n = Math.hypot(w, dx / length, dy / length);
  return [w / n, -dy / length / n, dx / length / n, 0];
}

// --- where bodies are at a sample, which may lie between two ---
class Poses {
  constructor(movie, position, orientation) {
    Object.assign(this, { movie, position, orientation, p: [0, 0, 0], q: [1, 0, 0, 0] });
  }

  at(body, sample) {
    if (body === WORLD_BODY) { this.p = [0, 0, 0]; this.q = [1, 0, 0, 0]; return; }
    const n = this.movie.bodies, low = Math.floor(sample), high = Math.min(low + 1, this.movie.count - 1), share = sample - low;
    const i = 3 * (low * n + body), j = 3 * (high * n + body), v = this.position;
    for (let k = 0; k < 3; k += 1) { this.p[k] = v[i + k] + (share ? share * (v[j + k] - v[i + k]) : 0); }
    if (!this.orientation) { this.q[0] = 1; this.q[1] = this.q[2] = this.q[3] = 0; return; }
    const a = 4 * (low * n + body), b = 4 * (high * n + body), o = this.orientation;
    let dot = 0, size = 0;
    for (let k = 0; k < 4; k += 1) { dot += o[a + k] * o[b + k]; }
    for (let k = 0; k < 4; k += 1) {
      this.q[k] = (1 - share) * o[a + k] + share * (dot < 0 ? -1 : 1) * o[b + k];
      size += this.q[k] * this.q[k];
    }
    size = Math.sqrt(size) || 1;
    for (let k = 0; k < 4; k += 1) { this.q[k] /= size; }
  }
}

// Solids of one shape as flat arrays, so that ten thousand are placed in a few milliseconds.
function packed(items) {
  const n = items.length, solids = { body: new Int32Array(n), offset: new Float64Array(3 * n), turn: new Float64Array(4 * n), scale: new Float64Array(3 * n) };
  items.forEach((item, i) => {
    solids.body[i] = item.body;
    solids.offset.set(item.offset, 3 * i);
    solids.turn.set(item.turn, 4 * i);
    solids.scale.set(item.scale, 3 * i);
  });
  return solids;
}

// The matrix of each solid at a sample: that of its body, and the solid's place and turn in it. What Poses.at and
// placeInto do for one, in one loop that makes nothing.
function placeAll(out, poses, solids, sample) {
  const { movie, position: v, orientation: o } = poses, { body, offset, turn, scale } = solids, n = movie.bodies;
  const low = Math.floor(sample), share = sample - low, high = share ? Math.min(low + 1, movie.count - 1) : low;
  for (let i = 0, at = 0; i < body.length; i += 1, at += 16) {
    const b = body[i], sx = scale[3 * i], sy = scale[3 * i + 1], sz = scale[3 * i + 2];
    let px = 0, py = 0, pz = 0, w = 1, x = 0, y = 0, z = 0;
    if (b !== WORLD_BODY) {
      const j = 3 * (low * n + b), k = 3 * (high * n + b);
      px = v[j]; py = v[j + 1]; pz = v[j + 2];
      if (share) { px += share * (v[k] - px); py += share * (v[k + 1] - py); pz += share * (v[k + 2] - pz); }
      if (o) {
        const a = 4 * (low * n + b), c = 4 * (high * n + b);
        w = o[a]; x = o[a + 1]; y = o[a + 2]; z = o[a + 3];
        if (share) {
          const near = w * o[c] + x * o[c + 1] + y * o[c + 2] + z * o[c + 3] < 0 ? -share : share, rest = 1 - share;
          w = rest * w + near * o[c]; x = rest * x + near * o[c + 1]; y = rest * y + near * o[c + 2]; z = rest * z + near * o[c + 3];
        }
        const size = Math.sqrt(w * w + x * x + y * y + z * z) || 1;
        w /= size; x /= size; y /= size; z /= size;
      }
    }
    const ox = offset[3 * i], oy = offset[3 * i + 1], oz = offset[3 * i + 2];
    if (ox || oy || oz) {
      const tx = 2 * (y * oz - z * oy), ty = 2 * (z * ox - x * oz), tz = 2 * (x * oy - y * ox);
      px += ox + w * tx + y * tz - z * ty; py += oy + w * ty + z * tx - x * tz; pz += oz + w * tz + x * ty - y * tx;
    }
    const tw = turn[4 * i];
    if (tw !== 1) {
      const tx = turn[4 * i + 1], ty = turn[4 * i + 2], tz = turn[4 * i + 3], bw = w, bx = x, by = y, bz = z;
      w = bw * tw - bx * tx - by * ty - bz * tz; x = bw * tx + bx * tw + by * tz - bz * ty;
      y = bw * ty - bx * tz + by * tw + bz * tx; z = bw * tz + bx * ty - by * tx + bz * tw;
    }
    const xx = 2 * x * x, yy = 2 * y * y, zz = 2 * z * z, xy = 2 * x * y, xz = 2 * x * z, yz = 2 * y * z, wx = 2 * w * x, wy = 2 * w * y, wz = 2 * w * z;
    out[at] = sx * (1 - yy - zz); out[at + 1] = sx * (xy + wz); out[at + 2] = sx * (xz - wy); out[at + 3] = 0;
    out[at + 4] = sy * (xy - wz); out[at + 5] = sy * (1 - xx - zz); out[at + 6] = sy * (yz + wx); out[at + 7] = 0;
    out[at + 8] = sz * (xz + wy); out[at + 9] = sz * (yz - wx); out[at + 10] = sz * (1 - xx - yy); out[at + 11] = 0;
    out[at + 12] = px; out[at + 13] = py; out[at + 14] = pz; out[at + 15] = 1;
  }
}

// Of facets: the corners of each face, three numbers each.
function facesOf(size) {
  const faces = [];
  for (let start = 0; start < size.length;) {
    const end = start + 1 + 3 * size[start], face = [];
    for (let i = start + 1; i < end; i += 3) { face.push(size.slice(i, i + 3)); }
    faces.push(face);
    start = end;
  }
  return faces;
}

// The corners of the box in its own axes around a box or facets.
function cornersOf(solid) {
  const half = solid.kind === "box" ? solid.size.map((v) => v / 2) : null, points = half ? [half, half.map((v) => -v)] : facesOf(solid.size).flat();
  const ends = [0, 1, 2].map((k) => [Math.min(...points.map((p) => p[k])), Math.max(...points.map((p) => p[k]))]);
  return Array.from({ length: 8 }, (_, i) => ends.map((pair, k) => pair[(i >> k) & 1]));
}

const MOST_TURNED = 200;  // bodies whose corners are followed; of more, spheres around them
const EXPLODES = 10;  // times the extent of the first half: then that half is framed, and the rest leaves the picture

function extentOf(movie, count = movie.count) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const see = (x, y, z, r) => [x, y, z].forEach((v, k) => {
    if (Math.abs(v) < 1e6) { low[k] = Math.min(low[k], v - r); high[k] = Math.max(high[k], v + r); }
  });
  const reach = new Float64Array(movie.bodies), drawn = new Uint8Array(movie.bodies), corners = new Map();
  const few = movie.orientation && movie.bodies <= MOST_TURNED, start = new Poses(movie, movie.position, movie.orientation), place = [0, 0, 0];
  for (const solid of movie.solids) {
    if (solid.kind === "plane") { continue; }
    if (solid.kind === "facets" && solid.fixed) {  // a ground is as far as it reaches, and flat
      const corner = [0, 0, 0];
      for (const p of facesOf(solid.size).flat()) {
        turnInto(corner, solid.orientation, ...p);
        see(...corner.map((v, k) => v + solid.position[k]), 0);
      }
      continue;
    }
    const r = solid.kind === "box" ? Math.hypot(...solid.size) / 2 : solid.kind === "capsule" ? solid.size[0] + solid.size[1] / 2 :
      solid.kind === "facets" ? Math.max(...facesOf(solid.size).flat().map((p) => Math.hypot(...p))) : solid.size[0] || 0;
    if (solid.body === WORLD_BODY) { see(...solid.position, r); continue; }
    const aside = Math.hypot(...solid.position.map((v, k) => v - movie.position[3 * solid.body + k]));
    drawn[solid.body] = 1;
    if (few && ["box", "facets"].includes(solid.kind)) {  // a flat solid is framed as flat as it stays
      start.at(solid.body, 0);
      const away = [start.q[0], -start.q[1], -start.q[2], -start.q[3]], found = corners.get(solid.body) || [];
      for (const corner of cornersOf(solid)) {
        turnInto(place, solid.orientation, ...corner);
        place.forEach((v, k) => { place[k] = v + solid.position[k] - start.p[k]; });
        turnInto(place, away, ...place);
        found.push([...place]);
      }
      corners.set(solid.body, found);
    } else { reach[solid.body] = Math.max(reach[solid.body], r + aside); }
  }
  const stride = Math.max(1, Math.floor(count * movie.bodies / 60000));
  for (let sample = 0; sample < count; sample += stride) {
    for (let body = 0; body < movie.bodies; body += 1) {
      if (!drawn[body]) { continue; }
      const i = 3 * (sample * movie.bodies + body);
      see(movie.position[i], movie.position[i + 1], movie.position[i + 2], reach[body]);
      if (!corners.has(body)) { continue; }
      start.at(body, sample);
      for (const corner of corners.get(body)) {
        turnInto(place, start.q, ...corner);
        see(...place.map((v, k) => v + start.p[k]), 0);
      }
    }
  }
  for (const link of movie.links) {
    link.bodies.forEach((body, end) => { if (body === WORLD_BODY) { see(...link.anchors[end], 0); } });
  }
  for (const centre of movie.attractors) { see(...centre, 0); }
  if (count === movie.count && count > 20) {
    const first = extentOf(movie, Math.ceil(count / 2)), wide = (box) => Math.max(...box.high.map((v, k) => v - box.low[k]));
    if (wide({ low, high }) > EXPLODES * wide(first)) { return first; }
  }
  return low[0] <= high[0] ? { low, high } : { low: [-1, -1, -1], high: [1, 1, 1] };
}

// --- what turns about what: read off the motion, as a recorded joint says its ends alone ---

// The axis in its own frame about which a body turns all the while; null where it does not turn, or not about one.
function axisOf(movie, body) {
  const { orientation: o, bodies, count } = movie, stride = Math.max(1, Math.floor(count / 40));
  if (!o) { return null; }
  let found = null, most = 0.02;
  const turns = [];
  for (let sample = stride; sample < count; sample += stride) {
    const a = 4 * body, b = 4 * (sample * bodies + body);
    const [, x, y, z] = product([o[a], -o[a + 1], -o[a + 2], -o[a + 3]], [o[b], o[b + 1], o[b + 2], o[b + 3]]), size = Math.hypot(x, y, z);
    if (!(size > 0.02)) { continue; }
    turns.push([x / size, y / size, z / size]);
    if (size > most) { most = size; found = turns.at(-1); }
  }
  return found && turns.every((turn) => Math.abs(turn.reduce((sum, v, k) => sum + v * found[k], 0)) > 0.999) ? found : null;
}

// The viewer: a scan converter with a depth buffer on a 2-D canvas. Every sample knows which face it shows, so lines are drawn
// where faces end, as on a drawing, and a click knows what it hit. No graphics card is asked for.
'use strict';

// Samples in a picture at rest, and in one that moves.
const MOST_SAMPLES = 4e6, MOST_MOVING = 7e5;
// Light left on the lines round components, and on those between faces of one.
const INK = 0.16, FINE_INK = 0.42;
// Towards the lamps: right, up, towards the eye.
const LIGHT_KEY = [-0.42, 0.56, 0.71], LIGHT_FILL = [0.75, -0.1, 0.65];

function unpacked(text) {
  const raw = atob(text), out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out.buffer;
}

class Viewer {
  constructor(canvas, data) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d', { willReadFrequently: true });
    this.meshes = data.meshes.map((m) => ({
      positions: new Float32Array(unpacked(m.positions)), normals: new Int8Array(unpacked(m.normals)),
      triangles: new Uint32Array(unpacked(m.triangles)), faces: new Uint32Array(unpacked(m.faces)), names: m.names,
    }));
    this.parts = data.components.map((c) => ({ ...c, mesh: this.meshes[c.mesh], index: 0, first: 0, rgb: [0, 0, 0] }));
    let next = 1;
    this.parts.forEach((p, i) => { p.index = i; p.first = next; next += p.mesh.names.length; });
    this.owner = new Int32Array(next).fill(-1);
    for (const p of this.parts) this.owner.fill(p.index, p.first, p.first + p.mesh.names.length);
    this.tints = new Uint8Array(3 * next);
    this.thin = new Uint8Array(next);
    this.moves = this.parts.map(() => [0, 0, 0]);
    this.shown = this.parts.map(() => true);
    this.turn = { azimuth: -0.9, elevation: 0.55 };
    this.zoom = 1;
    this.pan = [0, 0];
    this.bounds = [this.bound(false), this.bound(true)];
    this.spread = 0;
    this.moving = false;
    this.pending = 0;
  }

  // Centre, half breadth and half height of the whole, apart or not.
  bound(apart) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const p of this.parts) {
      const m = p.pose, v = p.mesh.positions;
      for (let i = 0; i < v.length; i += 3) {
        for (let k = 0; k < 3; k++) {
          const w = m[4 * k] * v[i] + m[4 * k + 1] * v[i + 1] + m[4 * k + 2] * v[i + 2] + m[4 * k + 3] + (apart ? p.offset[k] : 0);
          if (w < low[k]) low[k] = w;
          if (w > high[k]) high[k] = w;
        }
      }
    }
    const centre = low.map((l, k) => (l + high[k]) / 2);
    const [x, y, z] = low.map((l, k) => (high[k] - l) / 2);
    return { centre, broad: Math.hypot(x, y) || 1, high: z || 1 };
  }

  // Right, up and towards the eye.
  axes() {
    const { azimuth: a, elevation: e } = this.turn;
    const [ca, sa, ce, se] = [Math.cos(a), Math.sin(a), Math.cos(e), Math.sin(e)];
    return [[-sa, ca, 0], [-se * ca, -se * sa, ce], [ca * ce, sa * ce, se]];
  }

  resize() {
    const box = this.canvas.getBoundingClientRect(), ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(2, Math.round(box.width * ratio)), height = Math.max(2, Math.round(box.height * ratio));
    if (width !== this.canvas.width || height !== this.canvas.height) [this.canvas.width, this.canvas.height] = [width, height];
    this.ratio = ratio;
  }

  // Asks for a picture, or only for other colours of the one there is.
  ask(raster = true) {
    this.wants = this.wants || raster;
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      if (this.wants) this.raster();
      this.wants = false;
      this.compose();
    });
  }

  prepare() {
    const { width, height } = this.canvas, all = width * height;
    let samples = 4 * all <= (this.moving ? MOST_MOVING : MOST_SAMPLES) ? 2 : 1;
    let step = 1;
    if (this.moving) while (all / (step * step) > MOST_MOVING) step++;
    this.samples = samples; this.step = step;
    const w = Math.ceil(width / step) * samples, h = Math.ceil(height / step) * samples;
    if (this.w !== w || this.h !== h) {
      this.w = w; this.h = h;
      this.depth = new Float32Array(w * h); this.ids = new Uint32Array(w * h); this.shade = new Uint8Array(w * h);
    }
    this.depth.fill(-Infinity); this.ids.fill(0);
    const [rest, apart] = this.bounds, t = this.spread;
    this.centre = rest.centre.map((c, k) => c + (apart.centre[k] - c) * t);
    const [broad, high] = ['broad', 'high'].map((k) => rest[k] + (apart[k] - rest[k]) * t), e = this.turn.elevation;
    const upright = Math.abs(Math.sin(e)) * broad + Math.abs(Math.cos(e)) * high;
    this.scale = 0.46 * Math.min(w / broad, h / upright) * this.zoom;
    this.origin = [w / 2 + this.pan[0] * w, h / 2 + this.pan[1] * h];
    this.frame = this.axes();
  }

  raster() {
    this.resize();
    this.prepare();
    for (const p of this.parts) if (this.shown[p.index]) this.draw(p);
    this.outline();
  }

  draw(part) {
    const { positions, normals, triangles, faces } = part.mesh, count = positions.length / 3;
    const m = part.pose, move = this.moves[part.index], scale = this.scale;
    const rows = this.frame.map((axis) => [0, 1, 2].map((k) => axis[0] * m[k] + axis[1] * m[4 + k] + axis[2] * m[8 + k]));
    const shift = this.frame.map((axis) => axis.reduce((s, a, k) => s + a * (m[4 * k + 3] + move[k] - this.centre[k]), 0));
    const X = new Float32Array(count), Y = new Float32Array(count), Z = new Float32Array(count), S = new Float32Array(count);
    const [r, u, c] = rows;
    for (let i = 0, j = 0; i < count; i++, j += 3) {
      const x = positions[j], y = positions[j + 1], z = positions[j + 2];
      X[i] = this.origin[0] + scale * (r[0] * x + r[1] * y + r[2] * z + shift[0]);
      Y[i] = this.origin[1] - scale * (u[0] * x + u[1] * y + u[2] * z + shift[1]);
      Z[i] = c[0] * x + c[1] * y + c[2] * z + shift[2];
      const nx = normals[j] / 127, ny = normals[j + 1] / 127, nz = normals[j + 2] / 127;
      const a = r[0] * nx + r[1] * ny + r[2] * nz, b = u[0] * nx + u[1] * ny + u[2] * nz, d = c[0] * nx + c[1] * ny + c[2] * nz;
      const key = Math.max(0, a * LIGHT_KEY[0] + b * LIGHT_KEY[1] + d * LIGHT_KEY[2]);
      const fill = Math.max(0, a * LIGHT_FILL[0] + b * LIGHT_FILL[1] + d * LIGHT_FILL[2]);
      S[i] = 255 * Math.min(1, 0.36 + 0.5 * key + 0.14 * fill + 0.1 * b * Math.abs(b));
    }
    for (let t = 0; t < faces.length; t++) {
      this.triangle(X, Y, Z, S, triangles[3 * t], triangles[3 * t + 1], triangles[3 * t + 2], part.first + faces[t]);
    }
  }

  triangle(X, Y, Z, S, a, b, c, id) {
    const xa = X[a], ya = Y[a], area = (X[b] - xa) * (Y[c] - ya) - (X[c] - xa) * (Y[b] - ya);
    // Counter-clockwise from outside is clockwise with y downwards.
    if (!(area < 0)) return;
    const { w, h, depth, ids, shade } = this, sparse = this.thin[id];
    const dx = (V) => ((V[b] - V[a]) * (Y[c] - ya) - (V[c] - V[a]) * (Y[b] - ya)) / area;
    const dy = (V) => ((V[c] - V[a]) * (X[b] - xa) - (V[b] - V[a]) * (X[c] - xa)) / area;
    const zx = dx(Z), zy = dy(Z), sx = dx(S), sy = dy(S), za = Z[a], sa = S[a];
    let t;
    if (Y[a] > Y[b]) { t = a; a = b; b = t; }
    if (Y[b] > Y[c]) { t = b; b = c; c = t; }
    if (Y[a] > Y[b]) { t = a; a = b; b = t; }
    const first = Math.max(0, Math.ceil(Y[a] - 0.5)), last = Math.min(h - 1, Math.ceil(Y[c] - 0.5) - 1);
    const long = (X[c] - X[a]) / (Y[c] - Y[a]);
    for (let y = first; y <= last; y++) {
      const py = y + 0.5, far = X[a] + (py - Y[a]) * long;
      const near = py < Y[b] ? X[a] + (py - Y[a]) * ((X[b] - X[a]) / (Y[b] - Y[a])) : X[b] + (py - Y[b]) * ((X[c] - X[b]) / (Y[c] - Y[b]));
      const from = Math.max(0, Math.ceil(Math.min(far, near) - 0.5)), to = Math.min(w - 1, Math.ceil(Math.max(far, near) - 0.5) - 1);
      let z = za + zx * (from + 0.5 - xa) + zy * (py - ya), s = sa + sx * (from + 0.5 - xa) + sy * (py - ya);
      for (let x = from, i = y * w + from; x <= to; x++, i++, z += zx, s += sx) {
        if (z > depth[i] && !(sparse && ((x ^ y) & 1 || y & 1))) {
          depth[i] = z; ids[i] = id; shade[i] = s < 0 ? 0 : s > 255 ? 255 : s;
        }
      }
    }
  }

  // Lines where faces and components end, taken from the light of their samples.
  outline() {
    const { w, h, ids, shade, owner, thin } = this;
    const ends = (id, other) => other !== id && !thin[other];
    for (let y = 0, i = 0; y < h; y++) {
      for (let x = 0; x < w; x++, i++) {
        const id = ids[i];
        if (!id || thin[id]) continue;
        const right = x + 1 < w ? ids[i + 1] : 0, down = y + 1 < h ? ids[i + w] : 0;
        const left = x ? ids[i - 1] : 0, up = y ? ids[i - w] : 0;
        if (right === id && down === id && left === id && up === id) continue;
        const own = owner[id], parts = (other) => ends(id, other) && owner[other] !== own;
        if (parts(right) || parts(down) || parts(left) || parts(up)) shade[i] *= INK;
        else if (ends(id, right) || ends(id, down)) shade[i] *= FINE_INK;
      }
    }
  }

  // Colours of what the samples know.
  compose() {
    const { w, h, ids, shade, samples: n, tints } = this;
    const width = w / n, height = h / n, picture = this.context.createImageData(width, height), out = picture.data;
    for (let y = 0, o = 0; y < height; y++) {
      for (let x = 0; x < width; x++, o += 4) {
        let r = 0, g = 0, b = 0, cover = 0;
        for (let j = 0; j < n; j++) {
          for (let k = 0, i = (y * n + j) * w + x * n; k < n; k++, i++) {
            const id = ids[i];
            if (!id) continue;
            const light = shade[i], at = 3 * id;
            r += tints[at] * light; g += tints[at + 1] * light; b += tints[at + 2] * light; cover++;
          }
        }
        if (cover) {
          const share = 1 / (255 * cover);
          out[o] = r * share; out[o + 1] = g * share; out[o + 2] = b * share; out[o + 3] = (255 * cover) / (n * n);
        }
      }
    }
    if (this.step === 1) {
      this.context.putImageData(picture, 0, 0);
      return;
    }
    this.scratch = this.scratch || document.createElement('canvas');
    [this.scratch.width, this.scratch.height] = [width, height];
    this.scratch.getContext('2d').putImageData(picture, 0, 0);
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.context.drawImage(this.scratch, 0, 0, width * this.step, height * this.step);
  }

  // The component and face at a point of the canvas (CSS px from its corner); null where there is nothing.
  pick(x, y) {
    const k = (this.ratio * this.samples) / this.step, X = Math.floor(x * k), Y = Math.floor(y * k);
    if (X < 0 || Y < 0 || X >= this.w || Y >= this.h) return null;
    let id = 0, solid = 0;
    // Of the few samples round it, one of something solid rather than of what is seen through.
    for (let j = 0; j < 2; j++) for (let i = 0; i < 2; i++) {
      const at = Math.min(Y + j, this.h - 1) * this.w + Math.min(X + i, this.w - 1);
      id = id || this.ids[at];
      if (this.ids[at] && !this.thin[this.ids[at]]) solid = solid || this.ids[at];
    }
    id = solid || id;
    return id ? { component: this.owner[id], face: id - this.parts[this.owner[id]].first } : null;
  }

  // A point (CSS px) where a face is seen, in the middle of a row of its samples; null for one that is hidden.
  where(component, face) {
    const id = this.parts[component].first + face, k = (this.ratio * this.samples) / this.step;
    let best = 0, at = null;
    for (let y = 0; y < this.h; y++) {
      for (let x = 0; x < this.w; x++) {
        let end = x;
        while (end < this.w && this.ids[y * this.w + end] === id) end++;
        if (end - x > best) { best = end - x; at = [(x + end) / 2 / k, (y + 0.5) / k]; }
        x = end;
      }
    }
    return at;
  }
}

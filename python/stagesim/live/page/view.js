// SPDX-License-Identifier: GPL-2.0-or-later
//
// Draws the world from above.

// Sizes in pixels, as in libstage/models/robot_marks.hh. A robot narrower than a dot is drawn as a dot.
const DOT_WIDTH = 5, SMALL_DOT_WIDTH = 3;
const EDGE_WIDTH = 5; // min width of a body with edges
const SCAN_WIDTH = 10; // min width of robots whose scans are requested
const MARGIN = 16; // pixels
const NEAR = 9; // max distance of a click from a robot that it selects, pixels
const MANY = 1000; // with more robots, dots are small
const SHORT_TRAIL = 900; // max number of points
const FIELD_OPACITY = 0.8; // the floor shines through
// Opacities of glows as in libstage/models/types/glow.hh; that of the edge is 0.
const GLOW_MIDDLE = 0.6, GLOW_HALF = 0.15;

/** The center and the scale of the view. Maps metres to CSS pixels. */
export class Camera {
  constructor() { Object.assign(this, { x: 0, y: 0, scale: 40, width: 1, height: 1 }); }
  toScreen(x, y) {
    return [(x - this.x) * this.scale + this.width / 2, (this.y - y) * this.scale + this.height / 2];
  }
  toWorld(px, py) {
    return [(px - this.width / 2) / this.scale + this.x, this.y - (py - this.height / 2) / this.scale];
  }
  /** Zooms by a factor; the point at the pixel (px, py) stays in place. */
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const [x, y] = this.toWorld(px, py);
    this.scale = Math.min(5000, Math.max(0.02, this.scale * factor));
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
  }
  /** Fits a box (metres) into the free part of the page, without `aside` pixels at the right, `below` at the
   *  bottom, and up to `before` at the left if there is space. */
  fit([left, bottom, right, top], aside, below, before) {
    if (!(right >= left)) [left, bottom, right, top] = [-5, -5, 5, 5];
    const width = Math.max(50, this.width - aside - 2 * MARGIN);
    const height = Math.max(50, this.height - below - 2 * MARGIN);
    this.scale = Math.min(width / Math.max(right - left, 0.5), height / Math.max(top - bottom, 0.5));
    const spare = width - (right - left) * this.scale;
    this.x = (left + right) / 2 + (aside - Math.min(Math.max(spare, 0), before)) / 2 / this.scale;
    this.y = (bottom + top) / 2 - below / 2 / this.scale;
  }
  get key() { return [this.x, this.y, this.scale, this.width, this.height].join(); }
}

export class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.camera = new Camera();
    this.still = document.createElement("canvas"); // cached picture of things that have not moved yet
    this.showScans = true;
    this.chosen = null; // id of the selected thing
    this.trail = [];
    this.fields = new Map(); // by the numbers of their models
    this.resize();
  }

  resize() {
    this.ratio = Math.min(devicePixelRatio || 1, 2);
    const { clientWidth, clientHeight } = this.canvas;
    Object.assign(this.camera, { width: clientWidth, height: clientHeight });
    for (const canvas of [this.canvas, this.still]) {
      canvas.width = Math.round(clientWidth * this.ratio);
      canvas.height = Math.round(clientHeight * this.ratio);
    }
    this.stillKey = "";
  }

  /** Reads the colours of the style sheet. */
  restyle() {
    const style = getComputedStyle(document.documentElement);
    for (const name of ["floor", "grid", "accent", "bad"]) this[name] = style.getPropertyValue(`--${name}`);
    this.stillKey = "";
  }

  /** Sets the scene of the next frame. */
  setScene(scene) {
    this.next = scene;
  }

  /** Sets the picture of a field for the next frame. */
  setField(field) {
    const picture = document.createElement("canvas");
    Object.assign(picture, { width: field.columns, height: field.rows });
    const context = picture.getContext("2d"), image = context.createImageData(field.columns, field.rows);
    for (let i = 0; i < field.rows * field.columns; i++)
      image.data.set([...field.rgb, Math.round(FIELD_OPACITY * field.shades[i])], 4 * i);
    context.putImageData(image, 0, 0);
    this.fields.set(field.id, { ...field, picture });
  }

  setFrame(frame) {
    for (const id of this.fields.keys()) if (!frame.fields.includes(id)) this.fields.delete(id);
    if (this.next) this.showScene();
    else if (this.frame) this.noteMoves(this.frame.places, frame.places);
    if (this.frame && frame.steps < this.frame.steps) this.trail = [];
    this.frame = frame;
    this.noteTrail();
  }

  showScene() {
    const moved = new Set(this.scene?.things.filter((_, i) => this.moves[i]).map((thing) => thing.id));
    this.scene = this.next;
    this.next = null;
    this.moves = this.scene.things.map((thing) => thing.robot || moved.has(thing.id));
    this.listStill();
  }

  noteMoves(before, now) {
    let some = false;
    for (let i = 0; i < this.moves.length; i++) {
      if (this.moves[i]) continue;
      for (let k = 3 * i; k < 3 * i + 3; k++)
        if (before[k] !== now[k] && !(Number.isNaN(before[k]) && Number.isNaN(now[k]))) this.moves[i] = some = true;
    }
    if (some) this.listStill();
  }

  /** Lists the things that have not moved yet, as a key for their cached picture. */
  listStill() {
    const still = this.scene.things.filter((_, i) => !this.moves[i]);
    this.stillThings = still.map((thing) => `${thing.id}:${thing.shape}`).join();
  }

  noteTrail() {
    const i = this.scene.index.get(this.chosen);
    if (i === undefined) return;
    const [x, y] = this.place(i), last = this.trail.at(-1);
    if (last && Math.hypot(last[0] - x, last[1] - y) < 0.02) return;
    if (last && Math.hypot(last[0] - x, last[1] - y) > 2) this.trail = [];
    this.trail.push([x, y]);
    if (this.trail.length > SHORT_TRAIL) this.trail.shift();
  }

  place(i) { return this.frame.places.subarray(3 * i, 3 * i + 3); }

  /** Returns the bounding box of all things: left, bottom, right, top in metres. */
  box() {
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    this.scene?.things.forEach((_, i) => {
      const [x, y, a] = this.place(i), own = this.scene.shape(i).box;
      if (!Number.isFinite(x) || !(own[2] >= own[0])) return;
      for (const [px, py] of [[own[0], own[1]], [own[2], own[1]], [own[0], own[3]], [own[2], own[3]]]) {
        const wx = x + px * Math.cos(a) - py * Math.sin(a), wy = y + px * Math.sin(a) + py * Math.cos(a);
        box[0] = Math.min(box[0], wx);
        box[1] = Math.min(box[1], wy);
        box[2] = Math.max(box[2], wx);
        box[3] = Math.max(box[3], wy);
      }
    });
    return box;
  }

  /** Returns the id of the robot at a pixel, or else of the movable thing; undefined: none. */
  find(px, py) {
    if (!this.frame) return undefined;
    const [x, y] = this.camera.toWorld(px, py);
    let best, nearest = Infinity;
    this.scene.things.forEach((thing, i) => {
      const [tx, ty] = this.place(i), away = Math.hypot(tx - x, ty - y), { radius } = this.scene.shape(i);
      const isHit = thing.robot ? away <= Math.max(radius, NEAR / this.camera.scale)
        : thing.movable && away <= radius && this.isIn(i, x, y);
      const distance = thing.robot ? away : 1e9 + away; // robots first
      if (isHit && distance < nearest) [best, nearest] = [thing.id, distance];
    });
    return best;
  }

  /** Returns whether a point is inside the body of a thing. */
  isIn(i, x, y) {
    const [tx, ty, a] = this.place(i), dx = x - tx, dy = y - ty;
    const own = [dx * Math.cos(a) + dy * Math.sin(a), dy * Math.cos(a) - dx * Math.sin(a)];
    const context = this.still.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    return this.scene.shape(i).areas.some((area) => context.isPointInPath(area.path, ...own, "evenodd"));
  }

  /** Returns the ids of visible robots that are large enough to show their scans. */
  robotsInView() {
    if (!this.frame) return [];
    return this.scene.things.filter((thing, i) => thing.robot && this.isSeen(i) &&
      this.width(i) >= SCAN_WIDTH).map((thing) => thing.id);
  }

  draw() {
    const context = this.canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    if (!this.frame) return context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    this.drawFloor(context);
    for (const field of this.fields.values()) this.drawField(context, field);
    for (const glow of this.frame.glows) this.drawGlow(context, glow);
    this.drawStill();
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.still, 0, 0);
    if (this.showScans) for (const scan of this.frame.scans) this.drawScan(context, scan);
    this.drawTrail(context);
    this.drawMoving(context);
    this.drawChoice(context);
  }

  // ---- layers ----

  drawFloor(context) {
    context.fillStyle = this.floor;
    context.fillRect(0, 0, this.canvas.width, this.canvas.height);
    this.drawGrid(context);
  }

  /** Draws the patches of a field. Those at its northern and eastern edge may reach beyond it and are cut off. */
  drawField(context, { pose, size, patch, rows, columns, picture }) {
    context.save();
    this.enter(context, ...pose);
    context.beginPath();
    context.rect(-size[0] / 2, -size[1] / 2, size[0], size[1]);
    context.clip();
    context.imageSmoothingEnabled = false;
    context.drawImage(picture, -size[0] / 2, -size[1] / 2, columns * patch[0], rows * patch[1]);
    context.restore();
  }

  drawGlow(context, { x, y, radius, color: [red, green, blue, opacity] }) {
    this.enter(context, x, y, 0);
    const paint = context.createRadialGradient(0, 0, 0, 0, 0, radius);
    for (const [at, share] of [[0, GLOW_MIDDLE], [0.5, GLOW_HALF], [1, 0]])
      paint.addColorStop(at, `rgb(${red} ${green} ${blue} / ${share * opacity / 255})`);
    context.fillStyle = paint;
    context.beginPath();
    context.arc(0, 0, radius, 0, 7);
    context.fill();
  }

  drawStill() {
    const key = `${this.camera.key} ${this.stillThings}`;
    if (key === this.stillKey) return;
    this.stillKey = key;
    const context = this.still.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.still.width, this.still.height);
    for (let i = 0; i < this.moves.length; i++) if (!this.moves[i] && this.isSeen(i)) this.drawThing(context, i);
  }

  drawGrid(context) {
    let step = 1;
    while (step * this.camera.scale < 22) step *= step.toString()[0] === "2" ? 2.5 : 2;
    while (step * this.camera.scale > 120) step /= 2;
    const [left, top] = this.camera.toWorld(0, 0);
    const [right, bottom] = this.camera.toWorld(this.camera.width, this.camera.height);
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.strokeStyle = this.grid;
    context.lineWidth = 1;
    context.beginPath();
    for (let x = Math.ceil(left / step) * step; x < right; x += step) {
      const px = Math.round(this.camera.toScreen(x, 0)[0]) + 0.5;
      context.moveTo(px, 0);
      context.lineTo(px, this.camera.height);
    }
    for (let y = Math.ceil(bottom / step) * step; y < top; y += step) {
      const py = Math.round(this.camera.toScreen(0, y)[1]) + 0.5;
      context.moveTo(0, py);
      context.lineTo(this.camera.width, py);
    }
    context.stroke();
  }

  drawMoving(context) {
    const dots = new Map(), size = this.scene.robots > MANY ? SMALL_DOT_WIDTH : DOT_WIDTH;
    for (let i = 0; i < this.moves.length; i++) {
      if (!this.moves[i] || !this.isSeen(i)) continue;
      const shape = this.scene.shape(i);
      if (this.width(i) >= size) {
        this.drawThing(context, i);
      } else if (shape.areas.length) {
        const fill = this.frame.isStalled(i) ? this.bad : shape.areas[0].fill;
        if (!dots.has(fill)) dots.set(fill, []);
        dots.get(fill).push(i);
      }
    }
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    for (const [fill, things] of dots) {
      context.fillStyle = fill;
      for (const i of things) {
        const [px, py] = this.camera.toScreen(...this.place(i));
        context.fillRect(px - size / 2, py - size / 2, size, size);
      }
    }
  }

  drawThing(context, i) {
    const shape = this.scene.shape(i), robot = this.scene.things[i].robot;
    this.enter(context, ...this.place(i));
    const small = this.width(i) < EDGE_WIDTH, stalled = this.frame.isStalled(i);
    context.lineWidth = 1 / this.camera.scale;
    for (const area of shape.areas) {
      context.fillStyle = area.fill;
      context.fill(area.path, "evenodd");
      if (small && !(robot && stalled)) continue;
      context.strokeStyle = robot && stalled ? this.bad : area.line;
      context.stroke(area.path);
    }
  }

  /** Draws the area that the rays have swept; for a single ray, the cone of its field of view. */
  drawScan(context, scan) {
    this.enter(context, scan.x, scan.y, scan.a);
    const longest = 4 * (this.camera.width + this.camera.height) / this.camera.scale;
    const path = new Path2D();
    path.moveTo(0, 0);
    const tip = (i, aside) => {
      const length = Math.min(scan.ranges[i], longest), angle = scan.bearings[i] + aside;
      path.lineTo(length * Math.cos(angle), length * Math.sin(angle));
    };
    const half = Math.min(Math.abs(scan.fov), 3) / 2;
    if (scan.count === 1) [-half, -half / 2, 0, half / 2, half].forEach((aside) => tip(0, aside));
    else for (let i = 0; i < scan.count; i++) tip(i, 0);
    path.closePath();
    const chosen = scan.thing === this.chosen, thin = scan.count === 1 ? 0.6 : 1;
    context.fillStyle = context.strokeStyle = this.accent;
    context.globalAlpha = thin * (chosen ? 0.17 : 0.09);
    context.fill(path);
    context.globalAlpha = thin * (chosen ? 0.5 : 0.2);
    context.lineWidth = 1 / this.camera.scale;
    context.stroke(path);
    context.globalAlpha = 1;
  }

  drawTrail(context) {
    if (this.trail.length < 2) return;
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.strokeStyle = this.accent;
    context.globalAlpha = 0.5;
    context.lineWidth = 2;
    context.beginPath();
    this.trail.forEach(([x, y], i) => {
      const [px, py] = this.camera.toScreen(x, y);
      if (i === 0) context.moveTo(px, py);
      else context.lineTo(px, py);
    });
    context.stroke();
    context.globalAlpha = 1;
  }

  drawChoice(context) {
    const i = this.scene.index.get(this.chosen);
    if (i === undefined) return;
    const [px, py] = this.camera.toScreen(...this.place(i));
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.strokeStyle = this.accent;
    context.lineWidth = 2;
    context.beginPath();
    context.arc(px, py, Math.max(this.scene.shape(i).radius * this.camera.scale + 5, 9), 0, 7);
    context.stroke();
  }

  // ---- helpers ----

  /** Returns the width of a thing in pixels. */
  width(i) { return 2 * this.scene.shape(i).radius * this.camera.scale; }

  isSeen(i) {
    const [x, y] = this.place(i), reach = this.scene.shape(i).radius, { camera } = this;
    return Math.abs(x - camera.x) <= camera.width / 2 / camera.scale + reach + 1 &&
      Math.abs(y - camera.y) <= camera.height / 2 / camera.scale + reach + 1;
  }

  /** Makes the context draw in the frame of a thing, in metres. */
  enter(context, x, y, a) {
    const [px, py] = this.camera.toScreen(x, y), size = this.ratio * this.camera.scale;
    const cosine = size * Math.cos(a), sine = size * Math.sin(a);
    context.setTransform(cosine, -sine, -sine, -cosine, this.ratio * px, this.ratio * py);
  }
}

// SPDX-License-Identifier: GPL-2.0-or-later
//
// Input by mouse, touch and keys.

const DRIVE = { // forwards, to the left, turning
  ArrowUp: [1, 0, 0], KeyW: [1, 0, 0], ArrowDown: [-1, 0, 0], KeyS: [-1, 0, 0],
  ArrowLeft: [0, 0, 1], KeyA: [0, 0, 1], ArrowRight: [0, 0, -1], KeyD: [0, 0, -1],
  KeyQ: [0, 1, 0], KeyE: [0, -1, 0],
};
const METRES = 0.5, RADIANS = 0.9, FASTER = 2.5; // m/s, rad/s, factor with Shift
const REPEAT = 200; // milliseconds between drive orders; less than the time for which one is valid
const MOVE = 40; // milliseconds between two move orders
const CLICK = 4; // max movement of a click, pixels

/** Mouse and touch: moves and zooms the view, selects and moves things. */
export class Pointer {
  /** `page` has choose(thing), follow(), move(thing, pose), changed(). */
  constructor(view, page) {
    Object.assign(this, { view, page, fingers: new Map(), held: null, turning: false, sent: 0 });
    const { canvas } = view;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => this.up(event));
    canvas.addEventListener("dblclick", (event) => {
      if (view.find(event.offsetX, event.offsetY) !== undefined) page.follow(true);
    });
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  down(event) {
    this.view.canvas.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
    this.from = [event.offsetX, event.offsetY];
    this.isClick = this.fingers.size === 1;
    this.held = this.isClick ? this.view.find(event.offsetX, event.offsetY) : undefined;
    this.turning = event.shiftKey || event.button === 2;
    if (this.held !== undefined) this.page.choose(this.held);
  }

  move(event) {
    const { canvas } = this.view, last = this.fingers.get(event.pointerId);
    if (!last) {
      canvas.classList.toggle("point", this.view.find(event.offsetX, event.offsetY) !== undefined);
      return;
    }
    const now = [event.offsetX, event.offsetY];
    if (Math.hypot(now[0] - this.from[0], now[1] - this.from[1]) > CLICK) this.isClick = false;
    if (this.isClick) return;
    canvas.classList.add("grab");
    if (this.fingers.size > 1) this.pinch(event.pointerId, now);
    else if (this.held !== undefined) this.moveThing(now, false);
    else this.pan(now[0] - last[0], now[1] - last[1]);
    this.fingers.set(event.pointerId, now);
    this.page.changed();
  }

  up(event) {
    if (!this.fingers.delete(event.pointerId)) return;
    this.view.canvas.classList.remove("grab");
    if (this.held !== undefined && !this.isClick) this.moveThing([event.offsetX, event.offsetY], true);
    else if (this.isClick && this.held === undefined) this.page.choose(null);
    this.held = undefined;
  }

  pan(dx, dy) {
    const { camera } = this.view;
    camera.x -= dx / camera.scale;
    camera.y += dy / camera.scale;
    this.page.follow(false);
  }

  pinch(id, now) {
    const other = [...this.fingers].find(([finger]) => finger !== id)[1], last = this.fingers.get(id);
    const length = (point) => Math.hypot(point[0] - other[0], point[1] - other[1]);
    this.view.camera.zoom(length(now) / Math.max(1, length(last)), (now[0] + other[0]) / 2, (now[1] + other[1]) / 2);
    this.pan((now[0] - last[0]) / 2, (now[1] - last[1]) / 2);
  }

  wheel(event) {
    event.preventDefault();
    const pixels = event.deltaY * (event.deltaMode === 1 ? 16 : 1);
    this.view.camera.zoom(Math.exp(-pixels * 0.0015), event.offsetX, event.offsetY);
    this.page.changed();
  }

  /** Moves the held thing to the pointer, or turns its front towards the pointer. */
  moveThing([px, py], last) {
    const i = this.view.scene?.index.get(this.held);
    if (i === undefined || !this.view.frame) return;
    const [x, y, a] = this.view.place(i), [to_x, to_y] = this.view.camera.toWorld(px, py);
    const pose = this.turning ? [x, y, Math.atan2(to_y - y, to_x - x)] : [to_x, to_y, a];
    this.view.frame.places.set(pose, 3 * i);
    if (!last && performance.now() < this.sent + MOVE) return;
    this.sent = performance.now();
    this.page.move(this.held, pose);
  }
}

/** Handles keys. `keys` maps values of event.key to functions, for keys that don't drive. */
export class Keys {
  /** `drive.to(velocity)` is called repeatedly while driving keys are down, and with zeros afterwards. */
  constructor(keys, drive) {
    Object.assign(this, { keys, drive, down: new Set(), fast: false, timer: 0 });
    addEventListener("keydown", (event) => this.press(event));
    addEventListener("keyup", (event) => this.release(event.code));
    addEventListener("blur", () => [...this.down].forEach((code) => this.release(code)));
  }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("input")) return;
    if (document.querySelector("dialog[open]")) return;
    this.fast = event.shiftKey;
    if (event.code in DRIVE && this.drive.isPossible()) {
      event.preventDefault();
      if (event.repeat) return;
      this.down.add(event.code);
      this.tell();
      return;
    }
    const act = this.keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act || (event.key === " " && event.target.matches("button"))) return;
    event.preventDefault();
    act();
  }

  release(code) {
    if (this.down.delete(code)) this.tell();
  }

  tell() {
    clearTimeout(this.timer);
    const sum = [0, 0, 0], faster = this.fast ? FASTER : 1;
    for (const code of this.down) DRIVE[code].forEach((part, i) => { sum[i] += part; });
    this.drive.to([METRES * sum[0] * faster, METRES * sum[1] * faster, RADIANS * sum[2] * faster]);
    if (this.down.size) this.timer = setTimeout(() => this.tell(), REPEAT);
  }
}

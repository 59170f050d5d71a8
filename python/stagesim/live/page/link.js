// SPDX-License-Identifier: GPL-2.0-or-later
//
// The connection to the server. messages.py defines the messages.

const AGAIN = 1000; // milliseconds until the next attempt

/** Connects and reconnects. Callbacks: scene(scene), field(field), frame(frame), error(text), state(connected). */
export class Link {
  constructor(callbacks) {
    this.callbacks = callbacks;
    this.shown = null; // number of the current scene
    this.connect();
  }

  connect() {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    this.socket = new WebSocket(`${scheme}//${location.host}/live${location.search}`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.callbacks.state(true);
    this.socket.onmessage = (event) => this.take(event.data);
    this.socket.onclose = () => {
      this.callbacks.state(false);
      setTimeout(() => this.connect(), AGAIN);
    };
  }

  /** Sends an order, such as send("pause", { on: true }). */
  send(what, parts = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ do: what, ...parts }));
  }

  take(buffer) {
    const length = new DataView(buffer).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    const words = new Words(buffer, 4 + length);
    if (header.type === "scene") {
      this.shown = header.scene;
      this.callbacks.scene({ ...header, words });
    } else if (header.type === "field") {
      this.callbacks.field({ ...header, shades: words.bytes });
    } else if (header.type === "frame" && header.scene === this.shown) {
      this.callbacks.frame(frameOf(header, words));
    } else if (header.type === "error") {
      this.callbacks.error(header.text);
    }
  }
}

/** Reads 32-bit words sequentially. */
export class Words {
  constructor(buffer, start) {
    this.whole = new Uint32Array(buffer, start);
    this.floats = new Float32Array(buffer, start);
    this.bytes = new Uint8Array(buffer, start);
    this.at = 0;
  }
  get isOver() { return this.at >= this.whole.length; }
  integer() { return this.whole[this.at++]; }
  float() { return this.floats[this.at++]; }
  color() { return this.bytes.subarray(4 * this.at, 4 * ++this.at); }
  take(count) {
    this.at += count;
    return this.floats.subarray(this.at - count, this.at);
  }
}

function frameOf(header, words) {
  const places = words.take(3 * header.things);
  const bits = words.bytes.subarray(4 * words.at);
  words.at += Math.ceil(header.things / 32);
  const glows = [];
  while (glows.length < header.glows)
    glows.push({ x: words.float(), y: words.float(), radius: words.float(), color: words.color() });
  const scans = [];
  while (!words.isOver) {
    const scan = { thing: words.integer(), count: words.integer() };
    words.take(5); // when it was sensed, and where the thing was then
    for (const part of ["x", "y", "a", "fov", "reach"]) scan[part] = words.float();
    scan.ranges = words.take(scan.count);
    scan.bearings = words.take(scan.count);
    scans.push(scan);
  }
  return { ...header, places, glows, scans, isStalled: (i) => (bits[i >> 3] >> (i & 7)) & 1 };
}

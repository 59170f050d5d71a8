// SPDX-License-Identifier: GPL-2.0-or-later
//
// The things of a world and their shapes, prepared for drawing.

const dark = matchMedia("(prefers-color-scheme: dark)");

/** The things of a world. Things of equal shape share it. `before` is the previous scene, whose shapes
 *  the server doesn't send again. */
export class Scene {
  constructor(message, before) {
    this.number = message.scene;
    this.world = message.world;
    this.things = message.things;
    this.index = new Map(this.things.map((thing, i) => [thing.id, i]));
    this.shapes = [...(before?.shapes.slice(0, message.first) ?? []),
      ...message.lengths.map((length) => shapeOf(message.words, length))];
    this.robots = this.things.filter((thing) => thing.robot).length;
  }
  shape(i) { return this.shapes[this.things[i].shape]; }
}

/** Unpacks a shape: its areas from low to high, each a path in metres, its radius and its bounding box. */
function shapeOf(words, length) {
  const end = words.at + length;
  const shape = { areas: [], radius: 0, box: [Infinity, Infinity, -Infinity, -Infinity] };
  while (words.at < end) {
    const [red, green, blue, opacity] = words.color();
    words.at += 2; // heights
    const path = new Path2D();
    for (let outlines = words.integer(); outlines > 0; outlines--) addOutline(words, path, shape);
    const area = { path, rgb: [red, green, blue], opacity: opacity / 255 };
    paint(area);
    shape.areas.push(area);
  }
  return shape;
}

function addOutline(words, path, shape) {
  const corners = words.take(2 * words.integer());
  const box = shape.box;
  for (let i = 0; i < corners.length; i += 2) {
    const x = corners[i], y = corners[i + 1];
    if (i === 0) path.moveTo(x, y);
    else path.lineTo(x, y);
    shape.radius = Math.max(shape.radius, Math.hypot(x, y));
    box[0] = Math.min(box[0], x);
    box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x);
    box[3] = Math.max(box[3], y);
  }
  path.closePath();
}

/** Sets an area's colours. World files assume a light floor; on a dark one, dark colours are lightened. */
function paint(area) {
  let rgb = area.rgb;
  const light = (0.3 * rgb[0] + 0.59 * rgb[1] + 0.11 * rgb[2]) / 255;
  if (dark.matches && light < 0.4) {
    const more = (0.4 - light) * 0.8;
    rgb = rgb.map((part) => Math.round(part + (255 - part) * more));
  }
  const line = rgb.map((part) => Math.round(dark.matches ? part + (255 - part) * 0.3 : part * 0.6));
  area.fill = `rgb(${rgb.join(" ")} / ${area.opacity})`;
  area.line = `rgb(${line.join(" ")} / ${area.opacity})`;
}

/** When the colour scheme changes, updates the colours of the scene get(), then calls back. */
export function watchColours(get, callback) {
  dark.addEventListener("change", () => {
    for (const shape of get()?.shapes ?? []) shape.areas.forEach(paint);
    callback();
  });
}

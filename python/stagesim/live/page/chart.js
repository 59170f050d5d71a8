// SPDX-License-Identifier: GPL-2.0-or-later
//
// A line chart of a value over the last minute.

const SPAN = 60; // seconds

export class Chart {
  /** `most`: the value at the top of the chart; 0: scale to the maximum. */
  constructor(canvas, { most = 0 } = {}) {
    this.canvas = canvas;
    this.most = most;
    this.points = []; // [seconds, value]
  }

  add(value) {
    const now = performance.now() / 1000;
    this.points.push([now, value]);
    while (this.points[0][0] < now - SPAN) this.points.shift();
  }

  draw(color, faint) {
    const ratio = devicePixelRatio || 1, { clientWidth: width, clientHeight: height } = this.canvas;
    if (this.canvas.width !== Math.round(width * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    const context = this.canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    context.fillStyle = faint;
    context.fillRect(0, height - 1, width, 1);
    if (this.points.length < 2) return;
    const end = this.points.at(-1)[0];
    const top = this.most || 1.1 * Math.max(...this.points.map((point) => point[1])) || 1;
    const line = new Path2D();
    for (const [time, value] of this.points)
      line.lineTo(width * (1 - (end - time) / SPAN), (height - 2) * (1 - Math.min(1, value / top)) + 1);
    const area = new Path2D(line);
    area.lineTo(width, height);
    area.lineTo(width * (1 - (end - this.points[0][0]) / SPAN), height);
    context.fillStyle = context.strokeStyle = color;
    context.globalAlpha = 0.14;
    context.fill(area);
    context.globalAlpha = 1;
    context.lineWidth = 1.5;
    context.lineJoin = "round";
    context.stroke(line);
  }
}

// The tool path, seen from above and in space. Rapids are coloured by what they leave, on a
// logarithmic scale whose colours rise in lightness only, so that all eyes see the order.

const VIRIDIS = [
  [68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137],
  [53, 183, 121], [109, 205, 89], [180, 222, 44], [253, 231, 37],
];
const SHADES = 48;
const NEAR = 14; // a click is on a line that is so near [px]

// Light paper: from light green up to dark violet. Dark paper: from blue up to light yellow.
function rampOf(dark) {
  const from = dark ? 2.7 : 7.2, to = dark ? 9 : 0;
  return Array.from({ length: SHADES }, (_, k) => {
    const at = from + ((to - from) * k) / (SHADES - 1), low = Math.max(0, Math.min(Math.floor(at), 8));
    const c = VIRIDIS[low].map((v, i) => Math.round(v + (VIRIDIS[low + 1][i] - v) * (at - low)));
    return `rgb(${c.join(",")})`;
  });
}

// Where a residual stands on the scale, 0 to 1.
class Scale {
  constructor(values, floor) {
    let most = 0;
    for (const column of values) for (const x of column) if (x > most) most = x;
    this.low = floor;
    this.high = Math.max(most, 10 * floor);
  }
  place(x) {
    if (!(x > this.low)) return 0;
    return Math.min(Math.log(x / this.low) / Math.log(this.high / this.low), 1);
  }
}

class Scene {
  // What both views draw: rapids with both ends known, and feed moves.
  constructor(rapids, feed) {
    const known = [0, 1, 2].map((k) => {
      const has = (x) => Number.isFinite(x);
      for (let i = k; i < feed.length; i += 3) if (has(feed[i])) return true;
      return rapids.start[k].some(has) || rapids.end[k].some(has);
    });
    // An axis of which nothing is ever known is left out of the picture, not all that moves.
    const at = (column, k, i) => (known[k] ? column[k][i] : 0);
    this.drawn = [];
    this.ends = new Float64Array(6 * rapids.count);
    for (let i = 0; i < rapids.count; i++) {
      let fine = known.includes(true);
      for (let k = 0; k < 3; k++) {
        this.ends[6 * i + k] = at(rapids.start, k, i);
        this.ends[6 * i + 3 + k] = at(rapids.end, k, i);
        fine = fine && Number.isFinite(this.ends[6 * i + k] + this.ends[6 * i + 3 + k]);
      }
      if (fine) this.drawn.push(i);
    }
    this.feed = Float64Array.from(feed, (x, i) => (known[i % 3] ? x : 0));
    for (let i = 0; i < feed.length; i += 3)
      if (![0, 1, 2].every((k) => Number.isFinite(this.feed[i + k]))) this.feed[i] = NaN;
    this.low = [Infinity, Infinity, Infinity];
    this.high = [-Infinity, -Infinity, -Infinity];
    const take = (k, x) => {
      if (x < this.low[k]) this.low[k] = x;
      if (x > this.high[k]) this.high[k] = x;
    };
    for (const i of this.drawn) for (let k = 0; k < 6; k++) take(k % 3, this.ends[6 * i + k]);
    for (let i = 0; i < this.feed.length; i += 3)
      if (this.feed[i] === this.feed[i]) for (let k = 0; k < 3; k++) take(k, this.feed[i + k]);
    this.empty = this.low[0] > this.high[0];
    if (this.empty) (this.low = [0, 0, 0]), (this.high = [1, 1, 1]);
    this.centre = this.low.map((x, k) => 0.5 * (x + this.high[k]));
  }
}

class View {
  constructor(figure, scene, paint, space) {
    Object.assign(this, { scene, paint, space });
    this.canvas = figure.querySelector("canvas");
    this.reset();
    for (const button of figure.querySelectorAll("button"))
      button.addEventListener("click", () => this.act(button.dataset.do));
    const keys = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down" };
    Object.assign(keys, { "+": "in", "=": "in", "-": "out", 0: "reset" });
    this.canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      this.act(keys[event.key]);
    });
    this.followPointer();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  reset() {
    this.turn = -0.6;
    this.tilt = 0.55;
    this.zoom = 1;
    this.pan = [0, 0];
  }

  act(what) {
    const step = 40;
    if (what === "in") this.zoom = Math.min(this.zoom * 1.4, 200);
    else if (what === "out") this.zoom = Math.max(this.zoom / 1.4, 0.5);
    else if (what === "reset") this.reset();
    else if (this.space) {
      if (what === "left") this.turn -= 0.2;
      if (what === "right") this.turn += 0.2;
      if (what === "up") this.tilt = Math.min(this.tilt + 0.15, Math.PI / 2);
      if (what === "down") this.tilt = Math.max(this.tilt - 0.15, -Math.PI / 2);
    } else {
      if (what === "left") this.pan[0] += step;
      if (what === "right") this.pan[0] -= step;
      if (what === "up") this.pan[1] += step;
      if (what === "down") this.pan[1] -= step;
    }
    this.draw();
  }

  followPointer() {
    let from = null, moved = 0;
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      if (event.button) return;
      from = [event.clientX, event.clientY];
      moved = 0;
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!from) return;
      const dx = event.clientX - from[0], dy = event.clientY - from[1];
      moved += Math.abs(dx) + Math.abs(dy);
      from = [event.clientX, event.clientY];
      if (moved < 4) return;
      if (this.space) {
        this.turn += 0.01 * dx;
        this.tilt = Math.max(Math.min(this.tilt + 0.01 * dy, Math.PI / 2), -Math.PI / 2);
      } else {
        this.pan = [this.pan[0] + dx, this.pan[1] + dy];
      }
      this.draw();
    });
    canvas.addEventListener("pointerup", (event) => {
      if (from && moved < 4) this.pick(event.offsetX, event.offsetY);
      from = null;
    });
    canvas.addEventListener("pointercancel", () => (from = null));
  }

  // From X, Y, Z [mm] to the canvas [px].
  projection(width, height) {
    const { low, high, centre } = this.scene;
    const turn = this.space ? this.turn : 0, tilt = this.space ? this.tilt : Math.PI / 2;
    const c = Math.cos(turn), s = Math.sin(turn), st = Math.sin(tilt), ct = Math.cos(tilt);
    const flat = (x, y, z) => [c * x - s * y, st * (s * x + c * y) + ct * z];
    const reach = [0, 0];
    for (let corner = 0; corner < 8; corner++) {
      const p = [0, 1, 2].map((k) => ((corner >> k) & 1 ? high : low)[k] - centre[k]);
      const [u, v] = flat(...p);
      reach[0] = Math.max(reach[0], Math.abs(u));
      reach[1] = Math.max(reach[1], Math.abs(v));
    }
    const fit = Math.min((0.5 * width - 26) / (reach[0] || 1), (0.5 * height - 30) / (reach[1] || 1));
    const scale = this.zoom * Math.max(fit, 1e-9);
    const px = 0.5 * width + this.pan[0], py = 0.5 * height + this.pan[1];
    const map = (x, y, z) => {
      const [u, v] = flat(x - centre[0], y - centre[1], z - centre[2]);
      return [px + scale * u, py - scale * v];
    };
    return { map, flat, scale };
  }

  draw() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => this.drawNow());
  }

  drawNow() {
    this.waiting = false;
    const { canvas, scene } = this;
    const ratio = Math.max(window.devicePixelRatio || 1, this.paint().printing ? 2 : 1);
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const paint = this.paint(), context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = paint.colours.sheet;
    context.fillRect(0, 0, width, height);
    const look = this.projection(width, height);
    this.drawFeed(context, look, paint);
    this.drawRapids(context, look, paint);
    this.drawScale(context, look, paint, width, height);
    if (scene.empty) {
      context.fillStyle = paint.colours.soft;
      context.textAlign = "center";
      context.font = "14px system-ui, sans-serif";
      context.fillText("no place of any move is known", width / 2, height / 2);
      context.textAlign = "left";
    }
  }

  drawFeed(context, look, paint) {
    const { feed } = this.scene;
    context.strokeStyle = paint.colours.feed;
    context.lineWidth = 0.8;
    context.lineJoin = "round";
    context.beginPath();
    let pen = false;
    for (let i = 0; i < feed.length; i += 3) {
      if (feed[i] !== feed[i]) {
        pen = false;
        continue;
      }
      const [x, y] = look.map(feed[i], feed[i + 1], feed[i + 2]);
      if (pen) context.lineTo(x, y);
      else context.moveTo(x, y);
      pen = true;
    }
    context.stroke();
  }

  drawRapids(context, look, paint) {
    const { drawn, ends } = this.scene;
    const shades = Array.from({ length: SHADES }, () => []), left = [], unknown = [];
    this.lines = new Float64Array(4 * ends.length / 6);
    for (const i of drawn) {
      const [x, y] = look.map(ends[6 * i], ends[6 * i + 1], ends[6 * i + 2]);
      const [u, v] = look.map(ends[6 * i + 3], ends[6 * i + 4], ends[6 * i + 5]);
      this.lines.set([x, y, u, v], 4 * i);
      const value = paint.value(i);
      if (value !== value) unknown.push(i);
      else {
        const shade = Math.round(paint.scale.place(value) * (SHADES - 1));
        (paint.planned(i) ? shades[shade] : (left[shade] ||= [])).push(i);
      }
    }
    this.stroke(context, unknown, paint.colours.left, 1.1, [2, 3]);
    for (let k = 0; k < SHADES; k++) {
      const width = 1.2 + (1.6 * k) / SHADES;
      this.stroke(context, left[k] || [], paint.ramp[k], width, [6, 4]);
      this.stroke(context, shades[k], paint.ramp[k], width, []);
    }
    if (paint.chosen >= 0 && drawn.includes(paint.chosen)) {
      this.stroke(context, [paint.chosen], paint.colours.paper, 8, []);
      this.stroke(context, [paint.chosen], paint.colours.mark, 3.5, []);
      const at = 4 * paint.chosen + 2;
      context.fillStyle = paint.colours.mark;
      context.beginPath();
      context.arc(this.lines[at], this.lines[at + 1], 5, 0, 7);
      context.fill();
    }
  }

  stroke(context, indices, colour, width, dash) {
    if (!indices.length) return;
    context.strokeStyle = context.fillStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.beginPath();
    const points = [];
    for (const i of indices) {
      const [x, y, u, v] = this.lines.subarray(4 * i, 4 * i + 4);
      if (Math.abs(x - u) + Math.abs(y - v) < 2) points.push([u, v]);
      context.moveTo(x, y);
      context.lineTo(u, v);
    }
    context.stroke();
    context.setLineDash([]);
    // A move along the line of sight is a dot.
    context.beginPath();
    for (const [x, y] of points) {
      context.moveTo(x, y);
      context.arc(x, y, (1.2 + width) * (this.scene.drawn.length > 2000 ? 0.5 : 1), 0, 7);
    }
    context.fill();
  }

  drawScale(context, look, paint, width, height) {
    const { colours, unit } = paint;
    context.strokeStyle = context.fillStyle = colours.soft;
    context.lineWidth = 1.2;
    context.font = "12px system-ui, sans-serif";
    if (!this.scene.empty) {
      const most = Math.min(150, width / 3) / (look.scale / unit.perMm);
      const power = 10 ** Math.floor(Math.log10(most));
      const length = [5, 2, 1].map((k) => k * power).find((x) => x <= most);
      const size = (length * look.scale) / unit.perMm;
      context.beginPath();
      context.moveTo(12, height - 14);
      context.lineTo(12, height - 10);
      context.lineTo(12 + size, height - 10);
      context.lineTo(12 + size, height - 14);
      context.stroke();
      context.fillText(`${Number(length.toPrecision(3))} ${unit.length}`, 16, height - 17);
    }
    // Directions, in the lower right corner.
    const from = [width - 44, height - 34];
    context.textAlign = "center";
    context.textBaseline = "middle";
    const names = this.space ? ["X", "Y", "Z"] : ["X", "Y"];
    names.forEach((name, k) => {
      const [u, v] = look.flat(...[0, 1, 2].map((i) => (i === k ? 1 : 0)));
      context.beginPath();
      context.moveTo(...from);
      context.lineTo(from[0] + 20 * u, from[1] - 20 * v);
      context.stroke();
      if (Math.hypot(u, v) > 0.25) context.fillText(name, from[0] + 29 * u, from[1] - 29 * v);
    });
    context.textAlign = "left";
    context.textBaseline = "alphabetic";
  }

  pick(x, y) {
    if (!this.lines) return;
    let best = NEAR, found = -1;
    for (const i of this.scene.drawn) {
      const [a, b, c, d] = this.lines.subarray(4 * i, 4 * i + 4);
      const dx = c - a, dy = d - b, size = dx * dx + dy * dy;
      const t = size ? Math.max(0, Math.min(1, ((x - a) * dx + (y - b) * dy) / size)) : 0;
      const far = Math.hypot(x - a - t * dx, y - b - t * dy);
      if (far < best) (best = far), (found = i);
    }
    if (found >= 0) this.paint().choose(found);
  }
}

// What is written over the picture of a scene: the length of a bar and the axes of the world.
"use strict";

// The largest of 1, 2 and 5 times a power of ten that is not above `most`.
function roundLength(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  return power * ([5, 2, 1].find((n) => n * power <= most * (1 + 1e-12)) || 1);
}

function lengthWords(metres) {
  const [unit, size] = metres >= 1e6 || metres < 1e-3 ? ["m", 1] : metres >= 1e3 ? ["km", 1e3] : metres >= 0.1 ? ["m", 1] : ["mm", 1e-3];
  return `${Number((metres / size).toPrecision(3))} ${unit}`.replace("e+", "e").replace("-", "−");
}

// Both in the lower corners of the picture.
const AXIS = 26, BAR = 0.2;  // px; share of the picture's width
class Marks {
  constructor(host) {
    const drawn = (tag, attributes) => {
      const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
      for (const [name, value] of Object.entries(attributes)) { element.setAttribute(name, value); }
      return element;
    };
    this.svg = drawn("svg", { class: "scene-marks", "aria-hidden": "true" });
    this.bar = drawn("path", {});
    this.length = drawn("text", { class: "length" });
    this.axes = [..."xyz"].map((letter) => {
      const axis = { line: drawn("path", {}), letter: drawn("text", { class: "axis" }) };
      axis.letter.textContent = letter;
      return axis;
    });
    this.svg.append(this.bar, this.length, ...this.axes.flatMap((axis) => [axis.line, axis.letter]));
    host.append(this.svg);
  }

  // `right` and `up` are the camera's axes, `scale` the pixels of a metre in the middle of the scene.
  show(wide, high, right, up, scale) {
    const metres = roundLength((BAR * wide) / scale), end = 14 + metres * scale;
    this.metres = metres;
    this.bar.setAttribute("d", `M14 ${high - 18}v8h${(metres * scale).toFixed(1)}v-8`);
    this.length.textContent = lengthWords(metres);
    this.length.setAttribute("x", ((14 + end) / 2).toFixed(1));
    this.length.setAttribute("y", String(high - 16));
    const x = wide - AXIS - 20, y = high - AXIS - 20;
    this.axes.forEach((axis, k) => {
      const dx = AXIS * right[k], dy = -AXIS * up[k], long = Math.hypot(dx, dy), away = long > 3 ? (long + 9) / long : 0;
      axis.line.setAttribute("d", `M${x} ${y}l${dx.toFixed(1)} ${dy.toFixed(1)}`);
      const aside = long < AXIS / 2 ? Math.max(9, Math.abs(away * dx)) : Math.abs(away * dx);  // clear of one that stands upright
      axis.letter.setAttribute("x", (x + Math.sign(dx) * aside).toFixed(1));
      axis.letter.setAttribute("y", (y + away * dy + 4).toFixed(1));
    });
  }

  close() { this.svg.remove(); }
}

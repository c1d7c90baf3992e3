// Runs live scenes outside a browser: questions as JSON on standard input, answers as JSON lines.
"use strict";
const fs = require("fs");
const path = require("path");
const { LiveEngine, simulateLive, observedOrder, energyOf } = require(path.resolve(process.argv[2]));

(async () => {
  const engine = await LiveEngine.from(fs.readFileSync(process.argv[3]));
  for (const { scene, parameters, steps, order } of JSON.parse(fs.readFileSync(0, "utf8"))) {
    const movie = simulateLive(engine, scene, parameters, { steps });
    const { change, scale } = energyOf(movie);
    console.log(JSON.stringify({
      status: movie.status, count: movie.count, bodies: movie.bodies, gravity: movie.gravity, hash: movie.stateHash,
      start: movie.solids.map((solid) => solid.position),
      position: Buffer.from(movie.position.buffer).toString("base64"),
      energy: Buffer.from(movie.energy.buffer).toString("base64"),
      orientation: movie.orientation ? Buffer.from(movie.orientation.buffer).toString("base64") : null,
      change: { change: Number.isFinite(change) ? change : Infinity, scale },
      ratio: movie.ratio ? Array.from(movie.ratio, (v) => (Number.isFinite(v) ? v : null)) : null,
      order: order ? observedOrder(engine, scene, parameters) : null,
    }));
  }
})();

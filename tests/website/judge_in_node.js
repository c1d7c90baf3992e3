// Judges pairs outside a browser: blocks and questions as JSON on standard input, changes as JSON.
"use strict";
const path = require("path");
const { judgeSeries, worseFirst, quantityOf } = require(path.resolve(process.argv[2]));
const { decodedRow } = require(path.resolve(process.argv[3]));

let text = "";
process.stdin.on("data", (part) => { text += part; });
process.stdin.on("end", () => {
  const { block, pairs, accepted } = JSON.parse(text);
  for (const level of accepted) { level.keys = new Set(level.keys); level.low = Number(level.low); level.high = Number(level.high); }
  const changes = [];
  const told = pairs.map(({ key, old, now, before, after }) => {
    const change = judgeSeries(key, old && decodedRow(block, old), now && decodedRow(block, now), before, after, accepted);
    if (!change) { return null; }
    changes.push(change);
    const { word, red, stands, name, sentence, decades, ulps, accepted: taken, blame, definition } = change;
    const shown = (value) => (value === null ? "–" : quantityOf(value, definition.unit, 7));
    return { word, red, stands, name, sentence, decades: Number.isFinite(decades) ? decades : null, ulps: ulps === null ? null : String(ulps), accepted: taken, blame, before: shown(change.before), after: shown(change.after) };
  });
  const sorted = changes.sort(worseFirst).map((change) => change.key);
  process.stdout.write(JSON.stringify({ told, sorted }));
});

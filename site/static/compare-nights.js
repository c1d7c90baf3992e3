// Nights as the files of compare/ hold them, in blocks: decoded, handed to judge.js. No page: also for Node.
"use strict";

const NIGHT_OUTCOMES = ["value", "out_of_limit", "not_finite", "diverged", "crashed", "timed_out", "missing", "not_supported", "unsettled"];

// The fields of all definitions stand once; those of one are put together when it is first asked for.
function definitionAt(block, place) {
  const told = block.definitions[place];
  if (Array.isArray(told)) { block.definitions[place] = Object.fromEntries(block.fields.map((name, i) => [name, told[i]])); }
  return block.definitions[place];
}

function decodedRow(block, row) {
  const number = (value) => (typeof value === "string" ? { nan: NaN, inf: Infinity, "-inf": -Infinity }[value] : value);
  const [definition, value, outcome = 0, flags = 0, hash = 0, failure = 0, usual = 0, suspected = 0, blame = 0] = row;
  return {
    definition: definitionAt(block, definition), value: number(value), outcome: NIGHT_OUTCOMES[outcome], passed: (flags & 1) === 1, held: (flags & 2) === 2,
    hash: block.texts[hash], failure: block.texts[failure], usual: usual ? usual.map(number) : null, suspected: suspected === 1, blame: block.texts[blame],
  };
}

// Every sample of one night of a block, by key: the last row that is not later.
function nightOf(block, place) {
  const samples = new Map();
  for (const [key, rows] of Object.entries(block.rows)) {
    let last = null;
    for (const row of rows) { if (row[0] <= place) { last = row; } else { break; } }
    if (last && last.length > 1) { samples.set(key, decodedRow(block, last.slice(1))); }
  }
  return { side: block.nights[place], samples };
}

if (typeof module !== "undefined") { module.exports = { decodedRow, nightOf }; }

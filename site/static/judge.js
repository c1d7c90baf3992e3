// Two nights compared in the page, by the rules of tracker/judge/compare.py and tracker/judge/verdict.py.
// A test asks both about ten thousand pairs and wants the same words. No page: also for Node.
"use strict";

const RANKS = { value: 0, unsettled: 1, out_of_limit: 2, not_finite: 3, diverged: 4, crashed: 4, timed_out: 4, missing: 5 };
const NO_VALUE = ["not_finite", "diverged", "crashed", "timed_out", "missing"];
const WORDS = ["missing", "removed", "regressed", "non_deterministic", "accepted", "expected", "not_comparable", "fixed", "improved", "changed", "new", "not_measured", "same", "identical"];
const RED = ["missing", "removed", "regressed", "non_deterministic"];
const STANDS = ["fail", "watch", "accepted", "none", "pass", "followed"];
const CALLED = { break_point: "less stable", ladder: "less accurate", order: "further from its order", time: "slower", work: "more work" };
const FAMILY = { scalar: "values", ladder: "sweep", order: "sweep", time: "sweep", break_point: "stability", work: "work" };
const SAID_IN_ULPS = 1e-10, DEEP_INSIDE = 1e-3, LAST_BITS = 16n, EXACT_ZERO = 1e-6, DOUBLED = 0.3;

const numberOf = (value) => (value === "nan" ? NaN : value === "inf" ? Infinity : value === "-inf" ? -Infinity : value);

// --- numbers in words, as Python writes them ---
function fixed(value, digits) {
  const parts = value * 2 ** (digits + 1);
  if (Number.isInteger(parts) && Math.abs(parts) % 2 === 1) {  // a tie goes to the even digit
    const twice = BigInt(Math.abs(parts)) * 5n ** BigInt(digits), low = twice / 2n;
    const text = String(low % 2n === 0n ? low : low + 1n).padStart(digits + 1, "0"), point = text.length - digits;
    return `${value < 0 ? "-" : ""}${text.slice(0, point)}${digits ? "." : ""}${text.slice(point)}`;
  }
  if (Math.abs(value) >= 1e21) { return `${BigInt(value)}${digits ? "." : ""}${"0".repeat(digits)}`; }
  return value.toFixed(digits);
}

function general(value, digits = 6) {
  if (Number.isNaN(value)) { return "nan"; }
  if (!Number.isFinite(value)) { return value > 0 ? "inf" : "-inf"; }
  if (value === 0) { return Object.is(value, -0) ? "-0" : "0"; }
  const [mantissa, power] = value.toExponential(digits - 1).split("e");
  const exponent = Number(power), trim = (text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
  if (exponent < -4 || exponent >= digits) {
    return `${trim(mantissa)}e${exponent < 0 ? "-" : "+"}${String(Math.abs(exponent)).padStart(2, "0")}`;
  }
  return trim(value.toFixed(Math.max(0, digits - 1 - exponent)));
}

function quantityOf(value, unit, digits) {
  const small = (n) => String(n).replace(/[-0-9]/g, (sign) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(sign)]);
  if (Number.isNaN(value)) { return "not a number"; }
  if (!Number.isFinite(value)) { return value > 0 ? "∞" : "−∞"; }
  let text = "0";
  if (value !== 0) {
    if (Math.abs(value) >= 1e-3 && Math.abs(value) < 1e6) {
      text = general(value, digits);
      if (text.includes("e")) { text = fixed(value, 0); }
    } else {
      let [mantissa, exponent] = value.toExponential(digits - 1).split("e");
      if (mantissa.includes(".")) { mantissa = mantissa.replace(/\.?0+$/, ""); }
      text = `${mantissa}×10${small(Number(exponent))}`;
      if (mantissa === "1" || mantissa === "-1") { text = text.replace("1×", ""); }
    }
  }
  return text.replace(/-/g, "−") + (unit === "" || unit === "1" ? "" : `\u202f${unit}`);
}

// --- one value on its own ---
function honest(sample) {
  if (NO_VALUE.includes(sample.outcome) || sample.outcome === "not_supported" || Number.isFinite(sample.value)) { return sample; }
  return { ...sample, outcome: "not_finite", passed: false, held: false };
}

function standing(definition, sample) {
  if (sample.outcome === "not_supported") { return "none"; }
  if (definition.role === "reported") { return "followed"; }
  const told = honest(sample);
  if (!told.passed) { return "fail"; }
  if (definition.limit === null && definition.set_point === null) { return "followed"; }
  return told.held || definition.set_point === null ? "pass" : "watch";
}

// For its limit alone, whichever engine's value it is.
function againstLimit(definition, sample) {
  if (sample.outcome === "not_supported") { return "none"; }
  if (!honest(sample).passed) { return "fail"; }
  return definition.limit === null ? "followed" : "pass";
}

function stands(definition, after, red) {
  if (!after) { return red ? "fail" : "none"; }
  const own = standing(definition, after);
  if (!red) { return own; }
  return own === "fail" || own === "none" || NO_VALUE.includes(after.outcome) || !Number.isFinite(after.value) ? "fail" : "watch";
}

// --- two values ---
const bits = new DataView(new ArrayBuffer(8));

function sameBits(a, b) { return Object.is(a, b); }

function placeOf(value) {
  bits.setFloat64(0, value);
  const whole = bits.getBigInt64(0);
  return whole >= 0n ? whole : -(whole & 0x7fffffffffffffffn);
}

function ulpsBetween(a, b) {
  if (!Number.isFinite(a) || !Number.isFinite(b)) { return null; }
  const far = placeOf(a) - placeOf(b);
  return far < 0n ? -far : far;
}

function decadesBetween(definition, old, now) {
  if (definition.better !== "smaller_magnitude" && definition.reference !== null) { old -= definition.reference; now -= definition.reference; }
  if (!Number.isFinite(old) || !Number.isFinite(now) || old === 0 || now === 0) { return null; }
  return Math.log10(Math.abs(now)) - Math.log10(Math.abs(old));
}

function badness(definition, value) {
  if (definition.better === "smaller_magnitude") { return Math.abs(value); }
  if (definition.reference !== null) { return Math.abs(value - definition.reference); }
  return definition.better === "larger" ? -value : definition.better === "smaller" ? value : null;
}

function halfWidth(definition) {
  const { better, limit } = definition;
  if (better === "larger" || better === "smaller" || limit === null) { return null; }
  return Array.isArray(limit) ? 0.5 * Math.abs(limit[1] - limit[0]) : Math.abs(limit);
}

const verdict = (word, sentence, rest = {}) => ({ word, sentence, name: "", decades: null, ulps: null, ...rest });
const spaced = (outcome) => outcome.replace(/_/g, " ");

function distance(decades, ulps, what) {
  const parts = [what];
  if (decades !== null && Math.abs(decades) >= 0.05) { parts.push(`by ${fixed(Math.abs(decades), 1)} decades`); } else if (decades !== null && Math.abs(decades) > SAID_IN_ULPS) {
    parts.push(`by ${general(100 * Math.abs(10 ** decades - 1), 2)} %`);
  }
  if (ulps !== null && ulps < 1000000n) { parts.push(`(${ulps} ULP)`); }
  return parts.join(" ");
}

function judge(definition, before, after, how) {
  if (!how.sameDefinition) { return verdict("not_comparable", "the definition of the test changed"); }
  if (!how.sameEnvironment) { return verdict("not_comparable", "measured in another float environment"); }
  if (before.outcome === "not_supported" || after.outcome === "not_supported") {
    if (before.outcome === after.outcome) { return verdict("same", "still not supported"); }
    if (after.outcome !== "not_supported") { return verdict("not_comparable", "supported for the first time"); }
    const words = "no longer supported" + (after.failure ? `: ${after.failure}` : "");
    return NO_VALUE.includes(honest(before).outcome) ? verdict("not_comparable", words) : verdict("removed", words, { name: "no longer supported" });
  }
  before = honest(before);
  after = honest(after);
  const old = before.value, now = after.value, decades = decadesBetween(definition, old, now), ulps = ulpsBetween(old, now);
  const twice = (far) => verdict("non_deterministic", "the same commit gave two answers", { name: "non-deterministic", decades, ulps: far });
  if (sameBits(old, now) && before.outcome === after.outcome) {
    const sameState = before.hash === after.hash || !before.hash || !after.hash;
    if (sameState || definition.kind === "work") { return verdict("identical", "the same bits", { ulps: 0n }); }
    return how.sameCommit ? twice(0n) : verdict("changed", "the same value from another final state", { ulps: 0n });
  }
  if (how.sameCommit) { return twice(ulps); }
  if (definition.kind === "work" && before.hash !== after.hash) { return verdict("changed", distance(decades, null, "other work for other answers")); }
  const byClass = judgeClass(before, after, decades, ulps);
  if (byClass) { return byClass; }
  if (!Number.isFinite(old) || !Number.isFinite(now)) { return verdict("same", `still ${spaced(after.outcome)}`); }
  if (definition.set_point !== null && before.held && !after.held) {
    const [low, high] = definition.set_point;
    return verdict("regressed", `left its set point ${general(low)} … ${general(high)}`, { name: "set point left", decades, ulps });
  }
  if (definition.set_point !== null && after.held && !before.held) { return verdict("fixed", "back at its set point", { decades, ulps }); }
  return judgeSize(definition, old, now, decades, ulps);
}

function judgeClass(before, after, decades, ulps) {
  const old = RANKS[before.outcome], now = RANKS[after.outcome];
  if (after.outcome === "missing" && now > old) {
    const gone = after.failure.startsWith("removed") ? "removed" : "missing";
    return verdict(gone, after.failure || "asked for and not answered", { name: gone });
  }
  const became = `${spaced(before.outcome)} became ${spaced(after.outcome)}`;
  if (now > old) {
    const crossed = after.outcome === "out_of_limit";
    const far = ulps === null || ulps > LAST_BITS ? "" : Number(ulps) === 0 ? ": the same value, at another limit" : ` by ${ulps} ULP: the last bits decide`;
    const what = crossed ? `crossed its limit${far}` : became;
    return verdict("regressed", what + (after.failure ? `: ${after.failure}` : ""), { name: crossed ? "limit crossed" : spaced(after.outcome), decades, ulps });
  }
  if (now < old) { return verdict(now === 0 ? "fixed" : "improved", became); }
  return before.outcome !== after.outcome ? verdict("changed", became) : null;
}

function calledWorse(kind, unit) {
  return kind === "time" && unit !== "s" && !unit.endsWith("/s") ? "worse" : CALLED[kind] || "worse";
}

function judgeSize(definition, old, now, decades, ulps) {
  const was = badness(definition, old), is = badness(definition, now);
  if (was === null || is === null) { return verdict("changed", distance(decades, ulps, "changed"), { decades, ulps }); }
  const growth = is - was;
  if (growth === 0) { return verdict("same", "the same magnitude", { decades, ulps }); }
  const directed = definition.better === "larger" || definition.better === "smaller";
  const rounding = definition.limit !== null || directed ? 0 : (definition.kind === "ladder" ? 1e-10 : 1e-12) * Math.max(1, Math.abs(definition.reference || 0));
  if (Math.abs(growth) <= Math.max(definition.tolerance, definition.relative_tolerance * Math.abs(was), rounding)) {
    return verdict("changed", distance(decades, ulps, "changed inside the tolerance"), { decades, ulps });
  }
  const words = distance(decades, ulps, growth > 0 ? "worse" : "better"), half = halfWidth(definition);
  const deep = half === null ? -Infinity : half * (Math.min(was, is) === 0 ? EXACT_ZERO : DEEP_INSIDE) * (1 + 1e-9);
  if (Math.max(was, is) <= deep) { return verdict("changed", `${words}, far inside the limit`, { decades, ulps }); }
  if (growth > 0) { return verdict("regressed", words, { name: calledWorse(definition.kind, definition.unit), decades, ulps }); }
  return verdict("improved", words, { decades, ulps });
}

// --- run times: against what was usual ---
const FROM_NONE = 1e9; // times as much stands for something in place of a value of 0

function judgeTime([level, threshold], value, larger, unit) {
  let change = !Number.isFinite(value) ? (Number.isFinite(level) ? Infinity : 0) : !Number.isFinite(level) ? -Infinity :
    level === 0 ? (value === 0 ? 0 : (larger ? -value : value) > 0 ? Infinity : -Infinity) : (larger === (level > 0) ? -1 : 1) * (value / level - 1);
  const percent = change >= 0.5 * FROM_NONE ? "from 0" : !Number.isFinite(change) ? (change > 0 ? "+inf %" : "-inf %") : `${change < 0 || Object.is(change, -0) ? "-" : "+"}${fixed(Math.abs(100 * change), 1)} %`;
  const words = `${percent} for the ${change > 0 ? "worse" : "better"}`;
  if (change > threshold) {
    if (!Number.isFinite(value)) { return verdict("regressed", `no finite value any more, ${general(level)} before`, { name: "not finite" }); }
    const ratio = level ? Math.abs(value / level) : 0;
    return verdict("regressed", words, { name: calledWorse("time", unit), decades: ratio > 2 / FROM_NONE && ratio < 0.5 * FROM_NONE ? Math.log10(ratio) : null });
  }
  if (-change > threshold) { return verdict("improved", words); }
  return verdict("same", `${words}, inside the noise (±${fixed(100 * threshold, 0)} %)`);
}

function judgeReadOff(definition, before, after, how) {
  let told;
  if (!how.sameMachine) { told = verdict("not_comparable", "run times of another machine"); } else {
    told = judge(definition, before, after, { sameDefinition: how.sameDefinition, sameEnvironment: true, sameCommit: false });
    if (["regressed", "improved", "changed"].includes(told.word) && before.outcome === after.outcome) {
      told = before.usual ? judgeTime(before.usual, after.value, definition.better === "larger", definition.unit) :
        verdict(Math.abs(told.decades || 0) > DOUBLED ? "changed" : "same", `${told.sentence}, of one timing session`, { decades: told.decades });
    }
  }
  if (after.suspected && before.usual && RED.includes(told.word)) { told = { ...told, word: "same", name: "", sentence: `${told.sentence}, to be confirmed by another night` }; }
  if (definition.read_off && RED.includes(told.word)) { told = { ...told, word: "changed", name: "", sentence: `${told.sentence}; the ladder's errors and its run time decide` }; }
  return told;
}

// --- one series: what became of it, or null where nothing is to be said ---
// A sample is { definition, value, outcome, passed, held, hash, failure, usual, suspected, blame }; a side is
// { engine, commit, dirty, machine, floats, day, whole, asked: { family: [tests] } }.
function judgeSeries(key, old, now, before, after, accepted) {
  const definition = (now || old).definition;
  if ((!old || !now) && definition.kind === "work") { return null; }
  let told, word = null;
  if (!old) { told = verdict("new", "measured for the first time"); } else if (!now) {
    const timed = definition.kind === "time", here = !timed || (!definition.read_off && before.machine === after.machine);
    const tests = (here ? timed ? ["values", "sweep"] : [FAMILY[definition.kind]] : []).filter((family) => after.asked[family]).map((family) => after.asked[family]);
    const missed = tests.some((asked) => asked.includes(definition.test));
    const removed = after.whole && definition.role === "gate" && tests.length > 0;
    if (old.outcome === "missing" && (missed || removed)) {
      told = verdict("identical", "still missing", { ulps: 0n });
    } else if (missed) {
      told = verdict("missing", "no longer measured by this test", { name: "missing" });
    } else if (removed) {
      told = verdict("removed", "the whole catalogue was asked, and this gate is not in it any more", { name: "removed" });
    } else { told = verdict("same", "not measured in this run"); word = "not_measured"; }
  } else {
    const sameDefinition = old.definition.version === now.definition.version;
    const another = sameDefinition ? ["unit", "better", "reference", "limit"].find((what) => old.definition.said[what] !== now.definition.said[what]) : null;
    const clean = before.commit !== "" && !before.dirty && !after.dirty;
    const how = {
      sameDefinition, sameEnvironment: before.floats === after.floats, sameMachine: before.machine === after.machine,
      sameCommit: clean && before.engine === after.engine && before.commit === after.commit,
    };
    if (another) { told = verdict("not_comparable", `another ${another}: ${old.definition.said[another]} and ${now.definition.said[another]}`); } else if (definition.kind === "time" && now.value !== old.value) {
      told = judgeReadOff(definition, old, now, how);
    } else { told = judge(definition, old, now, how); }
  }
  const red = RED.includes(told.word);
  const change = { key, definition, ...told, red, stands: stands(definition, now, red), before: old ? old.value : null, after: now ? now.value : null, accepted: "", blame: "" };
  if (word) { change.word = word; }
  const gone = told.word === "removed";
  if (red && (now || gone)) {
    const within = (a) => a.expected || (Number.isFinite(now.value) && a.low <= now.value && now.value <= a.high);
    const level = accepted.find((a) => a.keys.has(key) && (!a.until || after.day <= a.until) && (gone ? a.removed || a.expected : !a.removed && within(a)));
    if (level) { Object.assign(change, { word: level.expected ? "expected" : "accepted", red: false, stands: "accepted", accepted: level.said }); }
  }
  if (change.red && now && now.blame) {
    const of = /, of (\S+)$/.exec(now.blame); // what became worse before the earlier night did not between the two
    if (!of || !before.day || of[1] >= before.day) { change.blame = now.blame; }
  }
  return change;
}

// Worst first: by class, then by what happened, gates before the rest, then by decades, to a millionth: two
// logarithms differ in their last bits.
function worseFirst(one, other) {
  const rank = (c) => [c.red ? 0 : 1, c.red ? STANDS.indexOf(c.stands) : 0, WORDS.indexOf(c.word), c.definition.role === "gate" ? 0 : 1, -Math.floor((c.decades === null ? (c.red ? Infinity : 0) : Math.abs(c.decades)) * 1e6 + 0.5)];
  const a = rank(one), b = rank(other);
  for (let i = 0; i < a.length; i += 1) { if (a[i] !== b[i]) { return a[i] - b[i]; } }
  return one.key < other.key ? -1 : 1;
}

function overall(changes) {
  if (changes.some((c) => c.red)) { return "regressed"; }
  const compared = changes.filter((c) => !["not_comparable", "new", "not_measured"].includes(c.word));
  const values = changes.filter((c) => c.definition.kind !== "time");
  if (!compared.length || values.some((c) => c.word === "not_comparable" && c.definition.role !== "reported")) { return "not_comparable"; }
  const told = compared.filter((c) => c.definition.kind !== "time");
  return (told.length ? told : compared).every((c) => c.word === "identical") ? "identical" : "same";
}

if (typeof module !== "undefined") { module.exports = { judgeSeries, worseFirst, overall, quantityOf, numberOf, general, fixed }; }

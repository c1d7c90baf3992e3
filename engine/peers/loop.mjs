// What every engine in JavaScript shares: tasks as lines of JSON on standard input, the loop with its clock, and for each
// task an answer, a line of JSON with the number of bytes that follow, the float64 states. A state is 13 numbers a body:
// position, orientation (w, x, y, z), velocity, angular velocity (SI, world axes); then the forces of constraints that
// are asked for, one number for a rod's tension, six for a joint's force and torque; then the force between each pair of
// bodies whose contact forces are asked for, on its first; then the deepest penetration, if asked for. One process answers task after task, so an engine is compiled once; nothing of a scene is kept.
import { readSync, writeSync } from "node:fs";

const BLOCK = 1000; // steps between two looks at the clock where nothing is recorded between, at most
const LOOK = 50; // ms after which it is looked at again, or sooner
console.log = console.error; // standard output is for answers, whatever an engine has to say

/// Answer every task: `build(task)` gives `step()`, which takes one step, `state()`, what is to be kept of now, and
/// perhaps `free()`.
export async function serve(build) {
  for (let task = next(); task !== null; task = next()) {
    const began = performance.now();
    const made = await build(task);
    run(task, made, began);
    made.free?.();
  }
}

const left = []; // of standard input, after the last line
function next() {
  for (;;) {
    const end = left.length ? left.at(-1).indexOf(10) : -1;
    if (end >= 0) {
      const last = left.pop();
      const line = Buffer.concat([...left.splice(0), last.subarray(0, end)]).toString("utf8");
      if (end + 1 < last.length) left.push(last.subarray(end + 1));
      return JSON.parse(line);
    }
    const piece = Buffer.alloc(1 << 16);
    const got = readSync(0, piece, 0, piece.length, null);
    if (got === 0) return null;
    left.push(piece.subarray(0, got));
  }
}

function run(task, { step, state }, began) {
  const width = state().length;
  const states = new Float64Array((task.every_step ? task.steps + 1 : 2) * width);
  let kept = 0;
  const keep = () => states.set(state(), kept++ * width);
  const started = performance.now();
  const worked = processor();
  let spent = 0;
  let cpu = 0;
  let block = 1;
  let done = 0;
  let status = "completed";
  let failure = "";
  keep();
  while (done < task.steps && status === "completed") {
    const stop = task.every_step ? done + 1 : Math.min(done + block, task.steps);
    const busy = processor();
    const from = performance.now();
    for (; done < stop; done += 1) step();
    const now = performance.now();
    spent += now - from;
    cpu += processor() - busy;
    block = now - from < LOOK ? Math.min(2 * block, BLOCK) : Math.max(block >> 1, 1);
    if (task.every_step || done === task.steps) keep();
    if (!state().every(Number.isFinite)) {
      status = "not_finite";
      failure = `a value is not finite by step ${done}`;
    } else if (late(task, now - started, worked) && done < task.steps) {
      status = "timed_out";
      failure = `the time limit of ${task.time_limit} s was reached before step ${done + 1}`;
    }
  }
  const seconds = { seconds: spent / 1000, cpu_seconds: cpu / 1000, setup_seconds: (started - began) / 1000 };
  const bytes = 8 * kept * width;
  const head = JSON.stringify({ kept, steps: done, status, failure, bytes, ...seconds });
  answer(Buffer.concat([Buffer.from(`${head}\n`), Buffer.from(states.buffer, 0, bytes)]));
}

/// The limit is one of the processor's time, so that a busy machine changes no outcome; asked where as much has passed.
function late(task, passed, worked) {
  if (task.time_limit === null || passed <= 1000 * task.time_limit) return false;
  return processor() - worked > 1000 * task.time_limit;
}

function processor() {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1000; // ms
}

function answer(bytes) {
  for (let sent = 0; sent < bytes.length; ) {
    try {
      sent += writeSync(1, bytes, sent);
    } catch (error) {
      if (error.code !== "EAGAIN") throw error; // the reader is slower than we are
    }
  }
}

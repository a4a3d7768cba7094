// Judges photos through include/gonogo.mjs: node judge.mjs GONOGO.MJS GONOGO.WASM MODEL CALIBRATION PHOTO…
// Prints a line of JSON a photo, after making the mistakes a page can make.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

const [glue, module, modelFile, calibrationFile, ...photos] = process.argv.slice(2);
const { load, GREY8 } = await import(glue);
const gonogo = await load(readFileSync(module));
assert.match(gonogo.version, /^\d+\.\d+\.\d+/);

const [model, calibration] = [readFileSync(modelFile), readFileSync(calibrationFile)];
const good = readFileSync(photos[0]);
assert.throws(() => gonogo.open(new Uint8Array()), /E0803/);
assert.throws(() => gonogo.open(model.subarray(0, model.length / 2)), /E0802/);
assert.throws(() => gonogo.open(model, good), /E0803/);
assert.equal(gonogo.open(model).judge("uncalibrated", good).photo, "uncalibrated");
assert.equal(gonogo.calibrate(model, good), calibration.toString());

const inspector = gonogo.open(model, calibration);
const { width, height } = inspector;
assert.equal(inspector.judge("x", new Uint8Array()).verdict, "cannot-inspect");
const black = { data: new Uint8Array(width * height), width, height, format: GREY8 };
assert.equal(inspector.judgePixels("x", black).verdict, "cannot-inspect");
assert.match(inspector.judgePixels("x", { ...black, stride: width + 1 }).reason, /too few/);
assert.match(inspector.judgePixels("x", { ...black, width: 3 }).reason, /E0804/);
assert.throws(() => inspector.judgePixels("x", { ...black, format: 9, stride: width }), /9/);
for (const photo of photos) console.log(inspector.judgeText(photo, readFileSync(photo)));

// Shown, a photo has the same verdict, boxes and scores, and its grey values are those that were judged.
const { text, grey } = inspector.show(photos[0], good);
assert.ok(text.startsWith(inspector.judgeText(photos[0], good).slice(0, -1)));
const { decoded, nodes, outline } = JSON.parse(text);
assert.ok(decoded && nodes.length > 0 && outline.length === 4 && nodes.every((n) => !n.faulty && n.outline.length === 4));
const again = inspector.judgePixels(photos[0], { data: grey, width, height, format: GREY8 });
assert.deepEqual(again, inspector.judge(photos[0], good));
assert.equal(JSON.parse(inspector.show("x", good.subarray(0, 99)).text).decoded, false);

// Judging again and again takes no more memory.
const before = process.memoryUsage().arrayBuffers;
for (let i = 0; i < 20; i++) inspector.judgeText("again", good);
assert.ok(process.memoryUsage().arrayBuffers < before + (64 << 20));
inspector.close();

// gonogo in a browser or in Node: judges photos with a model file, in the page, without a server.
//
//     import { load } from "./gonogo.mjs";
//     const gonogo = await load(await (await fetch("gonogo.wasm")).arrayBuffer());
//     const inspector = gonogo.open(model, calibration);     // Uint8Array each; the calibration may be missing
//     const verdict = inspector.judge("a.png", photo);       // { verdict: "go", findings: [], … }
//     const { data, width, height } = canvas.getContext("2d").getImageData(0, 0, w, h);
//     inspector.judgePixels("canvas", { data, width, height });
//     inspector.close();
//
// What is wrong with a model or a calibration is thrown as an Error. A WebAssembly.RuntimeError is a fault of the library: load
// it anew. The functions behind this are those of gonogo.h.

export const GREY8 = 1, GREY16 = 2, RGB8 = 3, BGR8 = 4, RGBA8 = 5;

const ABI = 1;
const BYTES = { [GREY8]: 1, [GREY16]: 2, [RGB8]: 3, [BGR8]: 3, [RGBA8]: 4 };

/** Makes the library from the bytes of gonogo.wasm, or from a compiled WebAssembly.Module. */
export async function load(source) {
  const made = await WebAssembly.instantiate(source, {});
  const { exports } = made.instance ?? made;
  if (exports.gonogo_abi() !== ABI) throw new Error(`gonogo.wasm speaks ABI ${exports.gonogo_abi()}, this file ${ABI}`);
  return new Gonogo(exports);
}

class Gonogo {
  #exports;

  constructor(exports) {
    this.#exports = exports;
  }

  get version() {
    const bytes = new Uint8Array(this.#exports.memory.buffer, this.#exports.gonogo_version());
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }

  open(model, calibration = null) {
    const { gonogo_open, memory } = this.#exports;
    return this.#borrowing((lend) => {
      const [m, c, handle] = [lend(model), lend(calibration ?? new Uint8Array()), lend(new Uint8Array(4))];
      const given = calibration === null ? 0 : c.at;
      const { code, text } = this.#answer((out) => gonogo_open(m.at, m.size, given, c.size, handle.at, out));
      if (code !== 0) throw new Error(text);
      return new Inspector(this, new DataView(memory.buffer).getUint32(handle.at, true));
    });
  }

  /** The text of a calibration by the bytes of one photo of a correct assembly. */
  calibrate(model, photo) {
    return this.#borrowing((lend) => {
      const [m, p] = [lend(model), lend(photo)];
      const { code, text } = this.#answer((out) => this.#exports.gonogo_calibrate(m.at, m.size, p.at, p.size, out));
      if (code !== 0) throw new Error(text);
      return text;
    });
  }

  _size(handle) {
    return this.#borrowing((lend) => {
      const { at } = lend(new Uint8Array(8));
      this.#exports.gonogo_photo_size(handle, at, at + 4);
      return [...new Uint32Array(this.#exports.memory.buffer.slice(at, at + 8))];
    });
  }

  _judge(handle, name, file) {
    return this.#borrowing((lend) => {
      const [n, f] = [lend(zeroEnded(name)), lend(file)];
      return this.#verdict((out) => this.#exports.gonogo_judge_file(handle, n.at, f.at, f.size, out));
    });
  }

  _show(handle, name, file, pixels) {
    return this.#borrowing((lend) => {
      const [n, f, grey] = [lend(zeroEnded(name)), lend(file), lend(new Uint8Array(pixels))];
      const { gonogo_show_file, memory } = this.#exports;
      const text = this.#verdict((out) => gonogo_show_file(handle, n.at, f.at, f.size, grey.at, grey.size, out));
      return { text, grey: new Uint8Array(memory.buffer.slice(grey.at, grey.at + grey.size)) };
    });
  }

  _judgePixels(handle, name, { data, width, height, format = RGBA8, stride = width * BYTES[format] }) {
    return this.#borrowing((lend) => {
      const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
      const [n, d] = [lend(zeroEnded(name)), lend(bytes)];
      const image = lend(new Uint8Array(Uint32Array.of(d.at, d.size, stride, width, height, format).buffer));
      return this.#verdict((out) => this.#exports.gonogo_judge_pixels(handle, n.at, image.at, out));
    });
  }

  _close(handle) {
    this.#exports.gonogo_close(handle);
  }

  #verdict(call) {
    const { code, text } = this.#answer(call);
    if (code < 0) throw new Error(text);
    return text;
  }

  /** Calls a function with the place of a text to fill, and takes that text. */
  #answer(call) {
    return this.#borrowing((lend) => {
      const out = lend(new Uint8Array(8));
      const code = call(out.at);
      const [data, size] = new Uint32Array(this.#exports.memory.buffer.slice(out.at, out.at + 8));
      const text = new TextDecoder().decode(new Uint8Array(this.#exports.memory.buffer, data, size));
      this.#exports.gonogo_text_free(out.at);
      return { code, text };
    });
  }

  /** Runs `work` with a function that copies bytes into the library's memory; all copies are freed at the end. */
  #borrowing(work) {
    const { gonogo_alloc, gonogo_free, memory } = this.#exports;
    const lent = [];
    const lend = (bytes) => {
      // One byte at least: nothing has no place.
      const at = gonogo_alloc(Math.max(bytes.length, 1)) >>> 0;
      if (at === 0) throw new Error(`no memory for ${bytes.length} bytes`);
      lent.push([at, Math.max(bytes.length, 1)]);
      new Uint8Array(memory.buffer).set(bytes, at);
      return { at, size: bytes.length };
    };
    try {
      return work(lend);
    } finally {
      for (const [at, size] of lent) gonogo_free(at, size);
    }
  }
}

class Inspector {
  #gonogo;
  #handle;

  constructor(gonogo, handle) {
    this.#gonogo = gonogo;
    this.#handle = handle;
    [this.width, this.height] = gonogo._size(handle);
  }

  /** The verdict on the bytes of an image file, as an object. */
  judge(name, file) {
    return JSON.parse(this.judgeText(name, file));
  }

  /** The same as the line of JSON. */
  judgeText(name, file) {
    return this.#gonogo._judge(this.#handle, name, file);
  }

  /** The line of JSON with boxes and scores (see gonogo.h), and the photo's grey values as they were judged. */
  show(name, file) {
    return this.#gonogo._show(this.#handle, name, file, this.width * this.height);
  }

  /** The verdict on pixels: `{ data, width, height, format = RGBA8, stride }`, as a canvas gives them. */
  judgePixels(name, image) {
    return JSON.parse(this.#gonogo._judgePixels(this.#handle, name, image));
  }

  close() {
    this.#gonogo._close(this.#handle);
    this.#handle = 0;
  }
}

function zeroEnded(name) {
  return new TextEncoder().encode(`${name.replaceAll("\0", " ")}\0`);
}

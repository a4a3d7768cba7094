// Runs the extension for VS Code outside of it: `node extension.js EXTENSION PROGRAM`. The editor and its client library are
// stand-ins; the server is the real one, started as the extension says, over its real pipes.

const { spawn } = require("child_process");
const Module = require("module");
const path = require("path");

const [, , extension, program] = process.argv;
const registered = {};
const disposable = { dispose() {} };

const vscode = {
  workspace: {
    getConfiguration: (section) => ({ get: (key) => (`${section}.${key}` === "gonogo.path" ? program : undefined) }),
    createFileSystemWatcher: () => disposable,
    registerTextDocumentContentProvider: (scheme, provider) => ((registered[scheme] = provider), disposable),
  },
  commands: { registerCommand: (name, run) => ((registered[name] = run), disposable) },
};

// What vscode-languageclient does with the options it is given: it starts `run` and speaks over its pipes.
class LanguageClient {
  constructor(id, name, server, options) {
    Object.assign(this, { server, options, next: 1, waiting: new Map(), bytes: Buffer.alloc(0) });
  }

  async start() {
    const { command, args } = this.server.run;
    this.child = spawn(command, args, { stdio: ["pipe", "pipe", "inherit"] });
    this.child.stdout.on("data", (data) => this.read(data));
    const { initializationOptions } = this.options;
    this.result = await this.sendRequest("initialize", { capabilities: {}, initializationOptions });
    this.send({ method: "initialized", params: {} });
  }

  send(message) {
    const text = JSON.stringify({ jsonrpc: "2.0", ...message });
    this.child.stdin.write(`Content-Length: ${Buffer.byteLength(text)}\r\n\r\n${text}`);
  }

  sendRequest(method, params) {
    const id = this.next++;
    this.send({ id, method, params });
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  read(data) {
    this.bytes = Buffer.concat([this.bytes, data]);
    for (;;) {
      const head = this.bytes.indexOf("\r\n\r\n");
      if (head < 0) return;
      const length = Number(/Content-Length: (\d+)/.exec(this.bytes.toString("utf8", 0, head))[1]);
      if (this.bytes.length < head + 4 + length) return;
      const message = JSON.parse(this.bytes.toString("utf8", head + 4, head + 4 + length));
      this.bytes = this.bytes.subarray(head + 4 + length);
      const asked = message.method === undefined && this.waiting.get(message.id);
      if (asked) message.error ? asked.reject(new Error(message.error.message)) : asked.resolve(message.result);
    }
  }

  async stop() {
    const ended = new Promise((resolve) => this.child.on("exit", resolve));
    await this.sendRequest("shutdown");
    this.send({ method: "exit" });
    return ended;
  }
}

const load = Module._load;
Module._load = (name, ...rest) =>
  name === "vscode" ? vscode : name === "vscode-languageclient/node" ? { LanguageClient } : load(name, ...rest);

(async () => {
  const { activate, deactivate } = require(path.resolve(extension));
  const context = { subscriptions: [] };
  await activate(context);
  const page = async (name) => registered.gonogo.provideTextDocumentContent({ path: name });
  console.log(String(await page("/E0305.md")).split("\n")[0]);
  console.log(String(await page("/std/iso2338.gng")).includes("part iso2338(d, l) {"));
  await registered["gonogo.restart"]();
  console.log(String(await page("/E0102.md")).split("\n")[0]);
  console.log(`${context.subscriptions.length} to dispose of, ended with ${await deactivate()}`);
})().catch((error) => {
  console.error(error);
  process.exit(1);
});

// Starts `gonogo lsp` and shows the pages of diagnostics. Everything else is the server's work.

const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

async function start() {
  const command = vscode.workspace.getConfiguration("gonogo").get("path") || "gonogo";
  const server = { command, args: ["lsp"] };
  client = new LanguageClient("gonogo", "gonogo", { run: server, debug: server }, {
    documentSelector: [{ language: "gonogo" }],
    // The codes of diagnostics lead to their pages.
    initializationOptions: { explainLinks: true },
    synchronize: { fileEvents: vscode.workspace.createFileSystemWatcher("**/*.gng") },
  });
  await client.start();
}

// `gonogo:/E0305.md` is the page of E0305, `gonogo:/std/iso2338.gng` a file of the parts library.
const pages = {
  async provideTextDocumentContent(uri) {
    const code = uri.path.replace(/^\//, "").replace(/\.(md|gng)$/, "");
    return client.sendRequest("workspace/executeCommand", { command: "gonogo.explain", arguments: [code] });
  },
};

exports.activate = async (context) => {
  context.subscriptions.push(
    vscode.workspace.registerTextDocumentContentProvider("gonogo", pages),
    vscode.commands.registerCommand("gonogo.restart", async () => {
      await client?.stop();
      await start();
    }),
  );
  await start();
};

exports.deactivate = () => client?.stop();

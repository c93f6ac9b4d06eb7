// Starts `avastra lsp` and connects it to the editor. Everything else is the server's business.

const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

async function start() {
  const command = vscode.workspace.getConfiguration("avastra").get("command");
  const server = { command, args: ["lsp"] };
  client = new LanguageClient(
    "avastra",
    "avastra",
    { run: server, debug: server },
    {
      documentSelector: [{ language: "avastra" }],
      synchronize: { fileEvents: vscode.workspace.createFileSystemWatcher("**/*.{ava,xodr}") },
    },
  );
  try {
    await client.start();
  } catch (error) {
    vscode.window.showErrorMessage(
      `avastra: \`${command} lsp\` does not start (${error.message}); set \`avastra.command\``,
    );
  }
}

exports.activate = async (context) => {
  const restart = vscode.commands.registerCommand("avastra.restart", async () => {
    await client?.stop().catch(() => {});
    await start();
  });
  context.subscriptions.push(restart);
  await start();
};

exports.deactivate = () => client?.stop();

// What an editor gets from taplo's language server for a scene: node editor.mjs MODULES SCENE
//
// MODULES is a folder with node_modules/@taplo/lsp, SCENE a file with a `#:schema` line. Standard input is a JSON
// list of { text, at }: texts of the scene as somebody types it, and, where keys are to be completed, the text before
// the cursor. Printed is a JSON list of { errors, keys }: messages of diagnostics and labels of completions.
import { readFileSync, writeFileSync, existsSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, isAbsolute, resolve } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const [modules, scene] = process.argv.slice(2).map((path) => resolve(path));
const { TaploLsp } = createRequire(pathToFileURL(`${modules}/`))("@taplo/lsp");
const uri = pathToFileURL(scene).href;

const environment = {
  now: () => new Date(),
  envVar: (name) => process.env[name],
  envVars: () => Object.entries(process.env),
  stdErrAtty: () => false,
  stdin: process.stdin,
  stdout: process.stderr,
  stderr: process.stderr,
  glob: () => [],
  readFile: async (path) => readFileSync(path),
  writeFile: async (path, bytes) => writeFileSync(path, bytes),
  urlToFilePath: (url) => (url.startsWith("file:") ? fileURLToPath(url) : new URL(url).pathname),
  isAbsolute,
  cwd: () => dirname(scene),
  findConfigFile: (from) => [".taplo.toml", "taplo.toml"].map((name) => resolve(from, name)).find(existsSync),
  fetch: { fetch, Headers, Request, Response },
};

const pending = new Map();
// Those of the syntax are published first, those of the schema after it was read.
const QUIET_MS = 1500;
let diagnostics = [];
let diagnosed = 0;
const onMessage = (message) => {
  if (message.id !== undefined && message.method) {
    // The server asks for its settings; it needs no catalogue of schemas from the network.
    const settings = { schema: { enabled: true, catalogs: [] } };
    const result = message.method === "workspace/configuration" ? message.params.items.map(() => settings) : null;
    server.send({ jsonrpc: "2.0", id: message.id, result });
  } else if (message.id !== undefined) {
    pending.get(message.id)?.(message);
  } else if (message.method === "textDocument/publishDiagnostics" && message.params.uri === uri) {
    diagnostics = message.params.diagnostics.map((one) => one.message);
    diagnosed = Date.now();
  }
};
const server = await TaploLsp.initialize(environment, { onMessage });
let last = 0;
const request = (method, params) =>
  new Promise((answer) => {
    pending.set(++last, answer);
    server.send({ jsonrpc: "2.0", id: last, method, params });
  });
const pause = (ms) => new Promise((done) => setTimeout(done, ms));
const settled = async () => {
  diagnosed = Infinity;
  while (!(Date.now() - diagnosed > QUIET_MS)) await pause(50);
  return diagnostics;
};
const notify = (method, params) => server.send({ jsonrpc: "2.0", method, params });

setTimeout(() => {
  console.error("no answer of the language server within 60 s");
  process.exit(1);
}, 60_000).unref();

await request("initialize", { processId: process.pid, rootUri: null, capabilities: {}, workspaceFolders: [{ uri: pathToFileURL(dirname(scene)).href, name: "scenes" }] });
notify("initialized", {});
const answers = [];
let version = 0;
for (const { text, at } of JSON.parse(readFileSync(0, "utf8"))) {
  version += 1;
  if (version === 1) {
    notify("textDocument/didOpen", { textDocument: { uri, languageId: "toml", version, text } });
  } else {
    notify("textDocument/didChange", { textDocument: { uri, version }, contentChanges: [{ text }] });
  }
  const answer = { errors: await settled(), keys: [] };
  if (at !== undefined) {
    const before = text.slice(0, text.indexOf(at) + at.length).split("\n");
    const position = { line: before.length - 1, character: before.at(-1).length };
    const { result } = await request("textDocument/completion", { textDocument: { uri }, position });
    answer.keys = (result?.items ?? result ?? []).map((item) => item.label);
  }
  answers.push(answer);
}
console.log(JSON.stringify(answers));
process.exit(0);
